#include "kernels/delassus/delassus.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

#include "kernels/delassus/delassus_solve.hpp"
#include "kernels/delassus/delassus_sweeps.hpp"

namespace talus {
namespace {

/// The impulses of a tower of equal cubes of mass 1 kg, each standing on the next by one contact, under one
/// step of gravity (g h = 1 m/s): contact k carries k + 1 cubes, r_N = k + 1, with the top contact first.
struct Tower {
  std::vector<MatrixEntry> entries;
  std::vector<double> q, mu;
};

Tower tower(std::int64_t cubes, double push = 0) {
  Tower t;
  for (std::int64_t c = 0; c < cubes; ++c) {
    const bool on_floor = c + 1 == cubes;
    for (std::int64_t k = 0; k < 3; ++k) {
      t.entries.push_back({3 * c + k, 3 * c + k, on_floor ? 1.0 : 2.0});
      if (c > 0) t.entries.push_back({3 * c + k, 3 * (c - 1) + k, -1.0});
      if (!on_floor) t.entries.push_back({3 * c + k, 3 * (c + 1) + k, -1.0});
    }
    // Gravity accelerates all cubes alike: only the lowest approaches what is under it.
    t.q.insert(t.q.end(), {on_floor ? -1.0 : 0.0, on_floor ? push : 0.0, 0.0});
    t.mu.push_back(0.5);
  }
  return t;
}

TEST(DelassusProblem, AddsEntriesAtTheSamePlaceAndLeavesOutBlocksNobodyGave) {
  const std::vector<MatrixEntry> entries = {{4, 4, 1.0}, {0, 0, 2.0}, {0, 0, 0.5}, {1, 5, 7.0}};
  const auto p = assemble_delassus(entries, std::vector<double>(9, 0.0), std::vector<double>(3, 0.1));
  ASSERT_EQ(p.contacts(), 3U);
  EXPECT_EQ(p.row_begin, (std::vector<std::int64_t>{0, 1, 1, 1}));
  EXPECT_EQ(p.column, (std::vector<std::int32_t>{1}));
  EXPECT_EQ(p.block[0](1, 2), 7.0);
  EXPECT_EQ(p.block[0].norm(), 7.0);
  EXPECT_EQ(p.diagonal[0].W(0, 0), 2.5);
  EXPECT_EQ(p.diagonal[1].W(1, 1), 1.0);
  EXPECT_EQ(p.diagonal[2].W.norm(), 0.0);
}

TEST(DelassusProblem, RefusesEntriesOutsideTheMatrix) {
  const std::vector<MatrixEntry> entries = {{0, 3, 1.0}};
  EXPECT_THROW(assemble_delassus(entries, std::vector<double>(3), std::vector<double>(1)),
               std::invalid_argument);
  EXPECT_THROW(assemble_delassus({}, std::vector<double>(4), std::vector<double>(1)), std::invalid_argument);
}

TEST(DelassusProblem, VelocityIsTheProductOfTheWholeUnsymmetricMatrix) {
  const std::vector<MatrixEntry> entries = {{0, 4, 2.0}, {4, 0, 3.0}, {5, 5, -1.0}, {1, 1, 1.0}};
  const std::vector<double> q = {1, 0, 0, 0, 0, 10}, r = {1, 2, 3, 4, 5, 6};
  const auto p = assemble_delassus(entries, q, std::vector<double>(2, 0.1));
  std::vector<double> u(6);
  relative_velocity(p, r, u);
  EXPECT_EQ(u, (std::vector<double>{11, 2, 0, 0, 3, 4}));
}

TEST(DelassusError, IsTheFormulaOfSiconosOnAProblemDoneByHand) {
  // W = 4 I, q = (-4, 0, 0), r = (0.5, 0, 0): u = (-2, 0, 0), z = (2.5, 0, 0), F = (-2, 0, 0), largest norm
  // |q| = 4. Scaled by D = 4: r' = 1, u' = -1, q' = -2, F' = -1.
  const std::vector<MatrixEntry> entries = {{0, 0, 4.0}, {1, 1, 4.0}, {2, 2, 4.0}};
  const auto p = assemble_delassus(entries, std::vector<double>{-4, 0, 0}, std::vector<double>{0.3});
  std::vector<double> u(3);
  const auto error = delassus_error(p, std::vector<double>{0.5, 0, 0}, u);
  EXPECT_DOUBLE_EQ(error.siconos, 0.5);
  EXPECT_DOUBLE_EQ(error.scaled, 0.5);
  EXPECT_EQ(u[0], -2);
}

TEST(DelassusError, ScaledMeasureDoesNotSeeTheUnits) {
  const Tower t = tower(5, 0.3);
  std::vector<double> r(15), u(15);
  for (std::size_t k = 0; k < r.size(); ++k) r[k] = 1 + 0.1 * static_cast<double>(k);
  const auto reference = delassus_error(assemble_delassus(t.entries, t.q, t.mu), r, u);
  // Masses in mg: W times 10^6, impulses divided by it.
  Tower other = t;
  for (auto& e : other.entries) e.value *= 1e6;
  for (auto& value : r) value /= 1e6;
  const auto changed = delassus_error(assemble_delassus(other.entries, other.q, other.mu), r, u);
  EXPECT_NEAR(changed.scaled, reference.scaled, 1e-12 * reference.scaled);
  EXPECT_GT(std::abs(changed.siconos - reference.siconos), 0.1 * reference.siconos);
}

TEST(Nlgs, TowerCarriesItsWeight) {
  const Tower t = tower(8);
  const auto p = assemble_delassus(t.entries, t.q, t.mu);
  std::vector<double> r(24, 0.0);
  const auto report = solve_nlgs(p, {.tolerance = 1e-12}, {}, r);
  EXPECT_TRUE(report.converged);
  for (std::size_t c = 0; c < 8; ++c) EXPECT_NEAR(r[3 * c], static_cast<double>(c + 1), 1e-9);
}

TEST(Nlgs, FloorPulledAwayFasterThanFrictionHoldsSlidesUnderTheTower) {
  // 8 kg m/s of weight and mu = 0.5 bring the tower's 8 kg to at most 0.5 m/s.
  const Tower t = tower(8, 3.0);
  const auto p = assemble_delassus(t.entries, t.q, t.mu);
  std::vector<double> r(24, 0.0), u(24);
  EXPECT_TRUE(solve_nlgs(p, {.tolerance = 1e-12}, {}, r).converged);
  relative_velocity(p, r, u);
  EXPECT_NEAR(r[21], 8, 1e-9);
  EXPECT_NEAR(r[22], -4, 1e-9);
  EXPECT_NEAR(u[22], 2.5, 1e-9);
}

TEST(Nlgs, MomentumAndDampingReachTheAnswerOfThePlainSweepInFarFewer) {
  const Tower t = tower(40);
  const auto p = assemble_delassus(t.entries, t.q, t.mu);
  std::vector<double> plain(120, 0.0), fast(120, 0.0);
  const auto slow_report = solve_nlgs(p, {.tolerance = 1e-10}, {.damping = 0, .momentum = 0}, plain);
  const auto fast_report = solve_nlgs(p, {.tolerance = 1e-10}, {}, fast);
  EXPECT_TRUE(slow_report.converged && fast_report.converged);
  EXPECT_LT(5 * fast_report.iterations, slow_report.iterations);
  for (std::size_t c = 0; c < 40; ++c) EXPECT_NEAR(fast[3 * c], plain[3 * c], 1e-5);
}

TEST(Nlgs, GoesBackToItsBestAnswerWhenItStalls) {
  // Contact 1 has no solution: the error cannot fall, and the sweeps after the best one must not lose it.
  const std::vector<MatrixEntry> entries = {{0, 0, 1.0}, {1, 1, 1.0}, {2, 2, 1.0}, {0, 3, 0.1}};
  const auto p =
      assemble_delassus(entries, std::vector<double>{-1, 0, 0, -1, 0, 0}, std::vector<double>{0.3, 0.3});
  std::vector<double> r(6, 0.0), u(6);
  const auto report = solve_nlgs(p, {.tolerance = 1e-6, .max_iterations = 5000}, {}, r);
  EXPECT_FALSE(report.converged);
  EXPECT_GE(report.rescues, 3);
  EXPECT_EQ(delassus_error(p, r, u).siconos, report.error.siconos);
}

TEST(Nlgs, ReportsAMissedToleranceAndHandsBackItsBestAnswer) {
  const Tower t = tower(50);
  const auto p = assemble_delassus(t.entries, t.q, t.mu);
  std::vector<double> r(150, 0.0), u(150);
  const auto report =
      solve_nlgs(p, {.tolerance = 1e-12, .measure = ErrorMeasure::siconos, .max_iterations = 37}, {}, r);
  EXPECT_FALSE(report.converged);
  EXPECT_EQ(report.iterations, 37);
  EXPECT_EQ(report.history.back().iteration, 37);
  for (const auto& check : report.history) EXPECT_GE(check.error.siconos, report.error.siconos);
  EXPECT_EQ(delassus_error(p, r, u).siconos, report.error.siconos);
}

TEST(Nlgs, StopsWhenAskedTo) {
  const Tower t = tower(50);
  const auto p = assemble_delassus(t.entries, t.q, t.mu);
  std::vector<double> r(150, 0.0);
  int checks = 0;
  const auto report = solve_nlgs(p, {.tolerance = 0, .stop = [&] { return ++checks == 5; }}, {}, r);
  EXPECT_FALSE(report.converged);
  EXPECT_EQ(report.iterations, 5);
}

TEST(Nlgs, KeepsASolutionItIsGiven) {
  const Tower t = tower(3);
  const auto p = assemble_delassus(t.entries, t.q, t.mu);
  std::vector<double> r = {1, 0, 0, 2, 0, 0, 3, 0, 0};
  const auto report = solve_nlgs(p, {.tolerance = 1e-10}, {}, r);
  EXPECT_TRUE(report.converged);
  EXPECT_EQ(report.iterations, 0);
}

TEST(Nlgs, GivesTheSameBitsForEntriesInAnyOrder) {
  const Tower t = tower(20, 0.4);
  auto reversed = t.entries;
  std::reverse(reversed.begin(), reversed.end());
  std::vector<double> a(60, 0.0), b(60, 0.0);
  solve_nlgs(assemble_delassus(t.entries, t.q, t.mu), {.tolerance = 1e-10}, {}, a);
  solve_nlgs(assemble_delassus(reversed, t.q, t.mu), {.tolerance = 1e-10}, {}, b);
  EXPECT_EQ(std::memcmp(a.data(), b.data(), a.size() * sizeof(double)), 0);
}

TEST(Nlgs, CountsContactsWhoseLawHasNoSolution) {
  // Contact 1 approaches and its block of W is zero: no impulse changes that.
  const std::vector<MatrixEntry> entries = {{0, 0, 1.0}, {1, 1, 1.0}, {2, 2, 1.0}};
  const auto p =
      assemble_delassus(entries, std::vector<double>{-1, 0, 0, -1, 0, 0}, std::vector<double>{0.3, 0.3});
  std::vector<double> r(6, 0.0);
  const auto report = solve_nlgs(p, {.tolerance = 1e-6, .max_iterations = 10}, {}, r);
  EXPECT_FALSE(report.converged);
  EXPECT_EQ(report.failed_contacts, 1);
  EXPECT_NEAR(r[0], 1, 1e-12);
}

TEST(Nlgs, SolvesAProblemWithoutContacts) {
  std::vector<double> r;
  const auto report = solve_nlgs(assemble_delassus({}, {}, {}), {}, {}, r);
  EXPECT_TRUE(report.converged);
  EXPECT_EQ(report.error.siconos, 0);
}

}  // namespace
}  // namespace talus
