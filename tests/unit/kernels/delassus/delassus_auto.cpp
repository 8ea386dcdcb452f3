/// `auto` against the single methods, by counted work: no clock decides what passes.

#include "kernels/delassus/delassus_auto.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "kernels/delassus/delassus_solve.hpp"
#include "tests/bench/contact_problems.hpp"

namespace talus {
namespace {

constexpr std::int64_t most_iterations = 3'000;  // of a single method: the verdict depends on no clock

DelassusReport solved(const DelassusProblem& problem, DelassusMethod method, double tolerance) {
  std::vector<double> r(3 * problem.contacts(), 0.0);
  return solve_delassus(problem, method, {.tolerance = tolerance, .max_iterations = most_iterations}, r);
}

/// Least work in which one of the single methods gets there; infinite when none does.
double least_work(const DelassusProblem& problem, double tolerance) {
  double least = std::numeric_limits<double>::infinity();
  for (const DelassusMethod method : all_delassus_methods) {
    if (method == DelassusMethod::automatic) continue;
    if (const auto report = solved(problem, method, tolerance); report.converged)
      least = std::min(least, report.work);
  }
  return least;
}

/// What a machine does in about a millisecond.
constexpr double millisecond = 2e6;  // multiplications

TEST(Auto, CostsAtMostTwoAndAHalfTimesTheBestSingleMethodOnADozenKindsOfProblems) {
  // The aim is twice the best. Hundreds of problems are raced for it in time by tests/bench/solve_race.cpp,
  // and not all of them keep it; a wedge in this dozen takes 2.2 times the best.
  std::size_t raced = 0;
  for (std::size_t index = 0; index < 12; ++index) {
    const bench::NamedProblem scene = bench::step_of_scene(3, index);
    if (scene.problem.contacts() < 20 || scene.problem.contacts() > 300) continue;
    for (const bench::NamedProblem& named : {scene, bench::disturbed(scene, 100 + index)}) {
      const double best = least_work(named.problem, 1e-4);
      if (!std::isfinite(best)) continue;
      const DelassusReport report = solved(named.problem, DelassusMethod::automatic, 1e-4);
      EXPECT_TRUE(report.converged) << named.name;
      EXPECT_LE(report.work, 2.5 * best + millisecond) << named.name;
      ++raced;
    }
  }
  EXPECT_GE(raced, 8U);
}

/// Sliding contacts of strong friction, coupled so that momentum makes sweeps run in circles.
bench::NamedProblem where_momentum_stands_still() {
  for (std::size_t index = 0;; ++index) {
    bench::NamedProblem named = bench::disturbed(bench::step_of_scene(1, 4), 1000 + index);
    const auto sweeps = solved(named.problem, DelassusMethod::nlgs_momentum, 1e-4);
    const auto conjugate = solved(named.problem, DelassusMethod::nncg, 1e-4);
    if ((conjugate.converged && sweeps.work > 4 * conjugate.work) || index == 60) return named;
  }
}

TEST(Auto, LeavesSweepsWithMomentumThatStandStill) {
  const bench::NamedProblem named = where_momentum_stands_still();
  const auto sweeps = solved(named.problem, DelassusMethod::nlgs_momentum, 1e-4);
  const auto report = solved(named.problem, DelassusMethod::automatic, 1e-4);
  EXPECT_TRUE(report.converged);
  EXPECT_LT(report.work, 0.75 * sweeps.work) << named.name;
}

TEST(Auto, GoesOnUntilItIsStoppedWhereNothingIsToBeFound) {
  // Contact 1 approaches and its block of W is zero: no method can help, and none may make auto give up.
  const std::vector<MatrixEntry> entries = {{0, 0, 1.0}, {1, 1, 1.0}, {2, 2, 1.0}};
  const auto p =
      assemble_delassus(entries, std::vector<double>{-1, 0, 0, -1, 0, 0}, std::vector<double>{0.3, 0.3});
  std::vector<double> r(6, 0.0);
  std::int64_t asked = 0;
  const auto report =
      solve_auto(p, {.tolerance = 1e-6, .stop = [&] { return ++asked == 30'000; }}, AutoSettings{}, r);
  EXPECT_FALSE(report.converged);
  EXPECT_TRUE(report.stopped);
  EXPECT_EQ(report.iterations, 30'000);
}

TEST(Auto, BeginsNoTurnBeyondItsWork) {
  const bench::NamedProblem named = bench::disturbed(bench::step_of_scene(1, 4), 3);
  std::vector<double> r(3 * named.problem.contacts(), 0.0), whole(r);
  const double needed = solve_auto(named.problem, {.tolerance = 1e-8}, {}, whole).work;
  const auto report = solve_auto(named.problem, {.tolerance = 1e-8, .most_work = 0.3 * needed}, {}, r);
  EXPECT_FALSE(report.converged);
  EXPECT_GE(report.work, 0.3 * needed);
  EXPECT_LT(report.work, 0.6 * needed);
}

TEST(Auto, GivesTheSameBitsAndWorkTwice) {
  const bench::NamedProblem named = bench::disturbed(bench::step_of_scene(1, 4), 3);
  std::vector<double> first(3 * named.problem.contacts(), 0.0), second(first);
  const DelassusGoal goal{.tolerance = 1e-8, .max_iterations = 2000};
  const auto one = solve_auto(named.problem, goal, {}, first),
             two = solve_auto(named.problem, goal, {}, second);
  EXPECT_EQ(std::memcmp(first.data(), second.data(), first.size() * sizeof(double)), 0);
  EXPECT_EQ(one.work, two.work);
  EXPECT_EQ(one.iterations, two.iterations);
}

}  // namespace
}  // namespace talus
