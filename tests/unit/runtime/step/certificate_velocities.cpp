// What a certificate says of the velocities of large clusters, from the work of the contacts' errors.

#include <gtest/gtest.h>

#include <cmath>
#include <utility>
#include <vector>

#include "tests/unit/runtime/step/known_problem.hpp"

namespace talus::certificate_test {
namespace {

TEST(Certificate, RemembersWhatAWorkOfErrorsIsWorth) {
  // 0.2 for 0.04: the next 0.008 are taken for twice 0.04, and 0.004 for 0.04, without another check.
  Situation given{.what = "",
                  .checks = {{0, 1}, {10, 1e-4, 1, 0.04}, {20, 1e-4, 1, 0.008}},
                  .verdict = Verdict::go_on,
                  .velocity_errors = {0.2}};
  EXPECT_EQ(judged(given).verdict, Verdict::go_on);
  EXPECT_NEAR(judged(given).result.velocity_error, 0.08, 1e-12);
  given.checks.push_back({30, 1e-4, 1, 0.0045});
  EXPECT_EQ(judged(given).verdict, Verdict::solved);
  EXPECT_EQ(judged(given).velocity_checks, 1u);
}

/// Verdict on a work of errors of 0.02 J where grains of 1 kg exchange 1 J, velocities being wrong. Without a
/// mass of small clusters there are none.
Verdict doubted(Certificate::Scales scales, std::vector<double> impulses, Exchanged by_small = {},
                SolverSettings settings = {.balance_tolerance = 0.05}) {
  Certificate certificate(settings);
  scales.wall_pushes.assign(impulses.size(), 0);
  certificate.begin(std::move(scales));
  const std::vector<double> of_small(by_small.mass > 0 ? 1 : 0, 0.0);
  KnownProblem problem(1, {0.5}, of_small);
  problem.exchanged = by_small;
  Verdict verdict = Verdict::go_on;
  for (const Found& found : {Found{0, 1}, Found{10, 1e-4, 1, 0.02}}) {
    CheckSums sums = sums_of(found, 1000);
    sums.wall_impulse.clear();
    for (const double impulse : impulses) sums.wall_impulse.emplace_back(impulse, 0, 0);
    verdict = certificate.judge(sums, {.iterations = found.iterations}, problem);
  }
  return verdict;
}

TEST(Certificate, ComparesTheWorkOfErrorsWithAllThatLargeClustersExchange) {
  using enum Verdict;
  EXPECT_EQ(doubted({.wall_inv_masses = {0}}, {5}), go_on);
  EXPECT_EQ(doubted({.wall_inv_masses = {0.25}}, {5}), solved) << "a pushed wall of 4 kg: 25/8 J more";
  EXPECT_EQ(doubted({.wall_inv_masses = {0.1}}, {5}), go_on) << "of 10 kg: 25/20 J";
  EXPECT_EQ(doubted({.wall_inv_masses = {1e6}}, {2}), go_on) << "a light one: 2 J, not 2e6";
  EXPECT_EQ(doubted({.wall_inv_masses = {0}, .drive = 3}, {5}), solved) << "grains that follow a driven wall";
  EXPECT_EQ(doubted({.wall_inv_masses = {0}, .drive = 1}, {5}), go_on);
  EXPECT_EQ(doubted({.wall_inv_masses = {0}}, {300}), solved) << "a hundredth of what presses: 3 m/s";
  EXPECT_EQ(doubted({.rounding_velocity = 3e-3}, {}), solved) << "rounding, at a tolerance of 1e-3: 3 m/s";
  EXPECT_EQ(doubted({.rounding_velocity = 1e-3}, {}), go_on);
  EXPECT_EQ(doubted({.wall_inv_masses = {0.25}}, {5}, {.energy = 0.01, .mass = 0.5}), go_on)
      << "the share of small clusters in walls is not of it";
}

// Answers about small clusters are dear, and do not end a step that goes on for large ones.
TEST(Certificate, AsksForSmallClustersOnceAndThenWhereThatMayEndTheStep) {
  const SolverSettings settings{.balance_tolerance = 0.05};
  Certificate certificate(settings);
  certificate.begin({.rounding_velocity = 0, .wall_pushes = {0}});
  KnownProblem problem(1, {0.5}, {0});
  const auto asked_behind = [&](const Found& found) {
    const Verdict verdict =
        certificate.judge(sums_of(found, 1000), {.iterations = found.iterations}, problem);
    EXPECT_EQ(verdict, found.iterations < 50 ? Verdict::go_on : Verdict::solved) << found.iterations;
    return problem.small_asked();
  };
  EXPECT_EQ(asked_behind({0, 1}), 0u);
  EXPECT_EQ(asked_behind({10, 1e-4, 1, 0.02}), 1u) << "how much of what is exchanged is theirs?";
  EXPECT_EQ(asked_behind({20, 1e-4, 1, 0.02}), 1u) << "the work of errors asks for more";
  EXPECT_EQ(asked_behind({40, 1e-4, 2, 1e-6}), 1u) << "the force at the wall does";
  EXPECT_EQ(asked_behind({80, 1e-4, 2, 1e-6}), 2u);
}

// A work that is nothing to all may be much to one.
TEST(Certificate, BelievesTheWorstOfSeveralLargeClusters) {
  SolverSettings settings{.balance_tolerance = 0.05};
  Certificate certificate(settings);
  certificate.begin({.rounding_velocity = 2e-6, .wall_pushes = {0}});
  KnownProblem problem(1, {0.5});
  problem.largest_work = 0.02;
  certificate.judge(sums_of({0, 1}, 1000), {.iterations = 0}, problem);
  const Found nearly_right{10, 1e-4, 1, 1e-9};
  EXPECT_EQ(certificate.judge(sums_of(nearly_right, 1000), {.iterations = 10}, problem), Verdict::go_on);
  EXPECT_NEAR(certificate.result().velocity_error, 0.5, 1e-12) << "what a check finds for it";
  EXPECT_NEAR(problem.floors.speed, 2e-3, 1e-15) << "rounding over the tolerance";
  EXPECT_EQ(problem.floors.interest, CertificateThresholds{}.interest);
  problem.largest_work.reset();
  EXPECT_EQ(certificate.judge(sums_of(nearly_right, 1000), {.iterations = 20}, problem), Verdict::solved);
}

// A bed at rest was certified with velocities 15 % wrong for a claim of 0.1 %, as a ball hit the floor beside
// it.
TEST(Certificate, AsksALargeClusterItselfWhereSmallOnesDoMostOfWhatIsDone) {
  const auto asked_where_small_ones_do = [](double part, double wall = 1) {
    const SolverSettings settings{.balance_tolerance = 0.05};
    Certificate certificate(settings);
    certificate.begin({.rounding_velocity = 0, .wall_pushes = {0}, .wall_inv_masses = {0}});
    KnownProblem problem(1, {0.5}, {0});
    problem.largest_work = 0.02;
    problem.several = false;
    problem.exchanged = {.energy = part, .mass = part > 0 ? 0.5 : 0};
    certificate.judge(sums_of({0, 1, wall}, 1000), {.iterations = 0}, problem);
    certificate.judge(sums_of({10, 1e-4, wall, 1e-9}, 1000), {.iterations = 10}, problem);
    return problem.floors.interest > 0;
  };
  EXPECT_TRUE(asked_where_small_ones_do(0.99));
  EXPECT_FALSE(asked_where_small_ones_do(0.01));
  EXPECT_TRUE(asked_where_small_ones_do(0.01, 1000)) << "who presses the wall?";
  EXPECT_TRUE(asked_where_small_ones_do(0)) << "nobody knows, as with cohesion";
}

TEST(Certificate, BoundsVelocitiesMoreLooselyWithFrictionOrAsTheUserSays) {
  using enum Verdict;
  // A work of 0.02 is taken for an error of 0.2.
  EXPECT_EQ(doubted({}, {}), go_on);
  EXPECT_EQ(doubted({.friction = true}, {}), solved) << "ten times the bound of 0.05";
  EXPECT_EQ(doubted({.friction = true}, {}, {}, {.velocity_tolerance = 0.1}), go_on);
  EXPECT_EQ(doubted({}, {}, {}, {.velocity_tolerance = 0.3}), solved);
}

// A bed on a belt was certified with a fifth of its momentum wrong for a claim of 0.036: a check of
// velocities knows little of contacts that slide, and 0.3 of the work was all that was believed.
TEST(Certificate, ClaimsTwiceTheWorkWithFrictionBeyondItsToleranceToo) {
  const auto claimed = [](double work, bool friction, Verdict expected = Verdict::solved,
                          double velocity_tolerance = 0, double wall_push = 10) {
    const SolverSettings settings{.balance_tolerance = 0.05, .velocity_tolerance = velocity_tolerance};
    Certificate certificate(settings);
    certificate.begin({.rounding_velocity = 0, .wall_pushes = {wall_push}, .friction = friction});
    KnownProblem problem(1, {0.01});
    certificate.judge(sums_of({0, 1}, 1000), {.iterations = 0}, problem);
    const Verdict verdict =
        certificate.judge(sums_of({10, 1e-4, 1, work}, 1000), {.iterations = 10}, problem);
    EXPECT_EQ(verdict, expected) << work;
    return certificate.result().velocity_claim;
  };
  EXPECT_DOUBLE_EQ(claimed(0.12, true), 0.24);
  EXPECT_DOUBLE_EQ(claimed(0.4, true), 0.8) << "more than 0.5, and no step is missed for it";
  EXPECT_DOUBLE_EQ(claimed(0.9, true), 1) << "nothing is known";
  EXPECT_DOUBLE_EQ(claimed(0.12, false), 0.012) << "the check knows";
  EXPECT_DOUBLE_EQ(claimed(0.3, true, Verdict::go_on, 0.1), 0.6) << "a bound of the user's is kept";
  EXPECT_DOUBLE_EQ(claimed(0.04, true, Verdict::solved, 0.1), 0.08);
  // Contacts exchange sqrt(2) N s, by their energy, and the wall gets 1 N s.
  EXPECT_DOUBLE_EQ(claimed(0.12, true, Verdict::solved, 0, 0), std::sqrt(2.0) * 0.24);
  EXPECT_DOUBLE_EQ(claimed(0.2, true, Verdict::solved, 0, 0), std::sqrt(2.0) * 0.4);
  EXPECT_DOUBLE_EQ(claimed(0.04, true, Verdict::solved, 0.1, 0), 0.08) << "a bound of the user's: velocities";
  EXPECT_DOUBLE_EQ(claimed(0.12, false, Verdict::solved, 0, 0), 0.012);
}

TEST(Certificate, AllowsVelocitiesWithFrictionTenTimesTheBalanceAndNoMoreThanAll) {
  for (const auto& [balance, allowed] : {std::pair(0.05, 0.5), {0.2, 1.0}, {2.0, 2.0}}) {
    const SolverSettings settings{.balance_tolerance = balance};
    EXPECT_DOUBLE_EQ(settings.velocity_allowed(true), allowed);
    EXPECT_DOUBLE_EQ(settings.velocity_allowed(false), balance);
  }
  EXPECT_EQ((SolverSettings{.velocity_tolerance = 3}.velocity_allowed(true)), 3);
}

}  // namespace
}  // namespace talus::certificate_test
