#include "kernels/global/body_parts.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "kernels/global/admm.hpp"
#include "kernels/global/body_solver.hpp"
#include "tests/unit/kernels/global/cut_problem.hpp"

namespace talus {
namespace {

using test::block;
using test::Cut;

/// Contacts dealt to `count` parts by height, and a few at random, so that grains stand in up to four.
std::vector<std::int32_t> by_height(const BodyProblem& problem, std::size_t count) {
  std::vector<std::int32_t> part;
  std::uint32_t draw = 1;
  const double top = problem.bodies[problem.grains - 1].x[2];
  for (const ContactEquation& c : problem.contacts) {
    draw = draw * 1664525U + 1013904223U;
    const double z = problem.bodies[static_cast<std::size_t>(c.first)].x[2] / (1.01 * top);
    const auto slice = static_cast<std::size_t>(z * static_cast<double>(count));
    part.push_back(static_cast<std::int32_t>(draw >> 29 == 0 ? (draw >> 8) % count : slice));
  }
  return part;
}

/// Rows of other processes stand behind those given.
class LinkToOthers final : public PartLink {
 public:
  explicit LinkToOthers(std::vector<double> others) : others_(std::move(others)) {}
  std::vector<double> gather(std::vector<std::vector<double>> rows) const override {
    std::vector<double> all = std::move(rows.front());
    all.insert(all.end(), others_.begin(), others_.end());
    return all;
  }

 private:
  std::vector<double> others_;
};

TEST(BodyParts, AddUpSomeColumnsAndTakeTheLargestOfOthers) {
  // Two groups of two sums and a largest value; rows of three parts.
  const LinkToOthers link({10, 20, 7, 30, 40, -1, 100, 200, 6, 300, 400, -2});
  const auto fill = [](std::size_t, std::span<double> row) {
    const double own[] = {1, 2, 5, 3, 4, -3};
    std::copy(std::begin(own), std::end(own), row.begin());
  };
  EXPECT_EQ(reduced_of(link, 1, {.sums = 2, .largest = 1}, 2, fill),
            (std::vector<double>{111, 222, 7, 333, 444, 0}));
  const auto one = [](std::size_t, std::span<double> row) { row[0] = row[1] = 1; };
  const std::vector<double> all = reduced_of(LinkToOthers({0, std::nan(""), 0, 0}), 1, {1, 1}, 1, one);
  EXPECT_EQ(all[0], 1);
  EXPECT_TRUE(std::isnan(all[1]));
}

TEST(BodyParts, SeeTheStiffnessAndTheHeavyBodiesOfTheWhole) {
  for (const double plate : {0.0, 1e4}) {
    BodyProblem whole = block(3, 12, 0.35, plate);
    whole.bodies[40].mass = 100;
    const double expected = estimate_stiffness(whole);
    for (const std::size_t count : {std::size_t{2}, std::size_t{7}}) {
      const Cut cut(whole, by_height(whole, count), count);
      const BodyParts parts(cut.parts, cut);
      EXPECT_NEAR(estimate_stiffness(parts), expected, 1e-12 * expected);
      const auto heavy = heavy_unknowns(parts);
      std::vector<std::size_t> names;
      for (std::size_t p = 0; p < count; ++p)
        for (std::int32_t b : heavy[p]) names.push_back(cut.name(p, static_cast<std::size_t>(b)));
      std::sort(names.begin(), names.end());
      EXPECT_EQ(names,
                plate > 0 ? (std::vector<std::size_t>{40, whole.grains}) : std::vector<std::size_t>{40});
    }
  }
}

TEST(BodyParts, FindALongRowBesideOneGrainOnAFloor) {
  constexpr std::int32_t row = 200;
  BodyProblem problem = block(1, row, 0, 0);
  problem.contacts.front().first = row;  // the floor holds another grain
  problem.bodies.push_back(problem.bodies.front());
  ++problem.grains;
  EXPECT_GT(estimate_stiffness(problem), 0.3 * row * row);
  std::vector<std::int32_t> part;
  for (std::int32_t k = 0; k < row; ++k) part.push_back(3 * k / row);
  const Cut cut(problem, part, 3);
  EXPECT_GT(estimate_stiffness(BodyParts(cut.parts, cut)), 0.1 * row * row);  // from another end or middle
}

TEST(BodyParts, FindTheHeaviestBodyWhereNothingHoldsThem) {
  BodyProblem whole = block(2, 8, 0.35, 0);
  std::erase_if(whole.contacts, [](const ContactEquation& c) { return c.second < 0; });
  whole.impulse.resize(whole.contacts.size());
  whole.bodies[17].mass = 50;
  const double expected = estimate_stiffness(whole);
  EXPECT_GT(expected, 0);
  const Cut cut(whole, by_height(whole, 5), 5);
  EXPECT_NEAR(estimate_stiffness(BodyParts(cut.parts, cut)), expected, 1e-12 * expected);
}

/// (B r).s = r.(B s) of the preconditioner shows in its effect: conjugate gradients come to an end, on the
/// same solution, in about as many steps.
TEST(BodyParts, SolveTheLinearSystemOfTheWhole) {
  for (const double mu : {0.35, 0.0}) {
    BodyProblem whole = block(4, 16, mu, 1e3);
    const auto solve = [&](std::span<const BodyProblem> problems, const PartLink& link, PartField& V) {
      const BodyParts parts(problems, link);
      std::vector<std::vector<double>> rho(parts.size());
      PartField f = parts.field();
      V = parts.field();
      for (std::size_t p = 0; p < parts.size(); ++p) {
        for (const ContactEquation& c : parts[p].contacts)
          rho[p].push_back(1e3 * effective_mass(parts[p], c));
        for (std::size_t b = 0; b < f[p].size(); ++b)
          f[p][b].u = parts[p].bodies[b].mass * parts[p].bodies[b].free.u;
      }
      return BodySolver(parts, rho, 16).solve(f, V, 1e-10, 1000);
    };
    const PartLink alone;
    PartField expected, V;
    const int steps = solve({&whole, 1}, alone, expected);
    ASSERT_LT(steps, 200);
    for (const std::size_t count : {std::size_t{3}, std::size_t{8}}) {
      const Cut cut(whole, by_height(whole, count), count);
      EXPECT_LE(solve(cut.parts, cut, V), 2 * steps) << "mu " << mu << ", parts " << count;
      for (std::size_t p = 0; p < count; ++p)
        for (std::size_t b = 0; b < V[p].size(); ++b) {
          const Twist& due = expected[0][cut.name(p, b)];
          EXPECT_LT((V[p][b].u - due.u).norm() + (V[p][b].w - due.w).norm(), 1e-8 * 0.01)
              << "mu " << mu << ", parts " << count << ", body " << cut.name(p, b);
        }
    }
  }
}

TEST(BodyParts, CarryTheLoadOfTheWhole) {
  for (const double mu : {0.35, 0.0}) {
    BodyProblem whole = block(3, 10, mu, 1e4);
    const double load = 1e4 * 0.01 + static_cast<double>(whole.grains) * 0.01;
    const BodyAdmmSettings settings{.tolerance = 1e-7, .balance_tolerance = 1e-4, .max_iterations = 300};
    const auto on_the_floor = [&](std::span<const Vec3> r) {
      double sum = 0;
      for (std::size_t k = 0; k < whole.contacts.size(); ++k)
        if (whole.contacts[k].second < 0) sum += r[k][2];
      return sum;
    };
    const BodyProblem cold = whole;
    const int alone = solve_admm(whole, settings).iterations;
    EXPECT_NEAR(on_the_floor(whole.impulse), load, 1e-3 * load);
    for (const std::size_t count : {std::size_t{4}, std::size_t{9}}) {
      Cut cut(cold, by_height(cold, count), count);
      const BodyAdmmResult result = solve_admm(cut.parts, cut, settings);
      EXPECT_TRUE(result.converged);
      EXPECT_LE(result.iterations, 2 * alone);
      EXPECT_NEAR(on_the_floor(cut.impulses(cold.contacts.size())), load, 1e-3 * load);
    }
  }
}

}  // namespace
}  // namespace talus
