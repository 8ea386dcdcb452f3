/// The solvers that factorise W, and `auto` that calls them.

#include "kernels/delassus/newton.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "kernels/delassus/delassus_admm.hpp"
#include "kernels/delassus/delassus_solve.hpp"
#include "kernels/delassus/global_problem.hpp"

namespace talus {
namespace {

/// A block on a floor by `feet` contacts at the corners of its base: 6 degrees of freedom, so that W is
/// singular from the third foot on. mass 2 kg, edges 1 m, moved by `push` along t and by gravity.
GlobalProblem table(std::size_t feet, double push, double mu) {
  GlobalProblem p;
  const double mass = 2, inertia = mass / 6;
  for (std::int64_t k = 0; k < 6; ++k) p.M.push_back({k, k, k < 3 ? mass : inertia});
  p.f = {-mass, mass * push, 0, 0, 0, 0};
  for (std::size_t c = 0; c < feet; ++c) {
    const double angle = 2 * 3.14159265358979 * static_cast<double>(c) / static_cast<double>(feet);
    const Vec3 arm(-0.5, 0.5 * std::cos(angle), 0.5 * std::sin(angle));
    for (std::int64_t k = 0; k < 3; ++k) {
      const Vec3 axis = Vec3::Unit(k),
                 turn = {arm[1] * axis[2] - arm[2] * axis[1], arm[2] * axis[0] - arm[0] * axis[2],
                         arm[0] * axis[1] - arm[1] * axis[0]};
      const auto column = static_cast<std::int64_t>(3 * c) + k;
      for (std::int64_t i = 0; i < 3; ++i) {
        p.H.push_back({i, column, axis[i]});
        p.H.push_back({3 + i, column, turn[i]});
      }
    }
    p.w.insert(p.w.end(), {0, 0, 0});
    p.mu.push_back(mu);
  }
  return p;
}

Vec3 total(const std::vector<double>& r) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t k = 0; k < r.size(); ++k) sum[static_cast<Eigen::Index>(k % 3)] += r[k];
  return sum;
}

TEST(Newton, CarriesATableOnManyFeetWhoseWIsSingular) {
  const DelassusProblem p = condense(table(12, 0.1, 0.5));
  std::vector<double> r(36, 0.0);
  const auto report = solve_newton(p, {.tolerance = 1e-12}, {}, r);
  EXPECT_TRUE(report.converged);
  EXPECT_NEAR(total(r)[0], 2, 1e-10);
  EXPECT_NEAR(total(r)[1], -0.2, 1e-10);  // held by friction
}

TEST(Newton, TableSlidesWithTheFrictionThatItsWeightGives) {
  const GlobalProblem global = table(12, 0.4, 0.1);
  const DelassusProblem p = condense(global);
  std::vector<double> r(36, 0.0);
  EXPECT_TRUE(solve_newton(p, {.tolerance = 1e-12}, {}, r).converged);
  EXPECT_NEAR(total(r)[0], 2, 1e-10);
  EXPECT_NEAR(total(r)[1], -0.2, 1e-10);
  const auto velocity = global_velocity(global, r);
  EXPECT_NEAR(velocity.v[1], 0.3, 1e-10);
  EXPECT_NEAR(velocity.v[0], 0, 1e-10);
}

TEST(Newton, SparseAndDenseFactorisationsSolveTheSameTable) {
  // 150 feet are factorised sparsely, and W of one body is full.
  const DelassusProblem p = condense(table(150, 0.1, 0.5));
  std::vector<double> r(450, 0.0);
  const auto report = solve_newton(p, {.tolerance = 1e-10}, {}, r);
  EXPECT_TRUE(report.converged) << report.error.siconos << ' ' << report.error.scaled;
  EXPECT_NEAR(total(r)[0], 2, 1e-8);
  EXPECT_NEAR(total(r)[1], -0.2, 1e-8);
}

TEST(Newton, HandsBackTheStartWhenNoStepIsBetter) {
  // Contact 1 approaches and its block of W is zero.
  const std::vector<MatrixEntry> entries = {{0, 0, 1.0}, {1, 1, 1.0}, {2, 2, 1.0}};
  const auto p =
      assemble_delassus(entries, std::vector<double>{-1, 0, 0, -1, 0, 0}, std::vector<double>{0.3, 0.3});
  std::vector<double> r(6, 0.0), u(6);
  const auto report = solve_newton(p, {.tolerance = 1e-8, .max_iterations = 50}, {}, r);
  EXPECT_FALSE(report.converged);
  EXPECT_EQ(delassus_error(p, r, u).siconos, report.error.siconos);
  for (const auto& check : report.history)
    EXPECT_GE(measured(check.error, ErrorMeasure::larger), measured(report.error, ErrorMeasure::larger));
}

TEST(Solvers, AllReachTheSameMotionOfTheTable) {
  for (const double push : {0.0, 0.1, 0.4}) {
    const GlobalProblem global = table(5, push, 0.2);
    const DelassusProblem p = condense(global);
    for (const DelassusMethod method : all_delassus_methods) {
      std::vector<double> r(15, 0.0);
      const auto report = solve_delassus(p, method, {.tolerance = 1e-10, .max_iterations = 100'000}, r);
      EXPECT_TRUE(report.converged) << name_of(method);
      EXPECT_NEAR(global_velocity(global, r).v[1], std::max(0.0, push - 0.2), 1e-8) << name_of(method);
    }
  }
}

TEST(Solvers, SameInputSameBits) {
  const DelassusProblem p = condense(table(30, 0.3, 0.2));
  for (const DelassusMethod method : all_delassus_methods) {
    std::vector<double> a(90, 0.0), b(90, 0.0);
    solve_delassus(p, method, {.tolerance = 1e-9, .max_iterations = 300}, a);
    solve_delassus(p, method, {.tolerance = 1e-9, .max_iterations = 300}, b);
    EXPECT_EQ(std::memcmp(a.data(), b.data(), a.size() * sizeof(double)), 0) << name_of(method);
  }
}

TEST(Solvers, NamesReadBack) {
  for (const DelassusMethod method : all_delassus_methods)
    EXPECT_EQ(delassus_method(name_of(method)), method);
  EXPECT_FALSE(delassus_method("gauss"));
}

TEST(GlobalProblem, EqualityConstraintsTakeTheirPartOfTheLoad) {
  // The table's lateral velocity is prescribed: v_t = 0.7, whatever friction does.
  GlobalProblem p = table(4, 0.0, 0.1);
  p.G = {{1, 0, 1.0}};
  p.b = {-0.7};
  const DelassusProblem contact = condense(p);
  std::vector<double> r(12, 0.0);
  EXPECT_TRUE(solve_delassus(contact, DelassusMethod::automatic, {.tolerance = 1e-10}, r).converged);
  const auto velocity = global_velocity(p, r);
  EXPECT_NEAR(velocity.v[1], 0.7, 1e-10);
  EXPECT_NEAR(velocity.l[0], 2 * 0.7 + 0.1 * 2, 1e-8);  // accelerates 2 kg and overcomes friction
}

TEST(GlobalProblem, RefusesASingularMassAndWrongSizes) {
  GlobalProblem p = table(3, 0, 0.1);
  p.M.pop_back();
  EXPECT_THROW(condense(p), std::invalid_argument);
  p = table(3, 0, 0.1);
  p.w.pop_back();
  EXPECT_THROW(condense(p), std::invalid_argument);
  p = table(3, 0, 0.1);
  p.H.push_back({6, 0, 1.0});
  EXPECT_THROW(condense(p), std::invalid_argument);
}

}  // namespace
}  // namespace talus
