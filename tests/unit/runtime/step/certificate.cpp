// What the certificate says of a step, and that each of its thresholds has a part in it.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "tests/unit/runtime/step/known_problem.hpp"

namespace talus::certificate_test {
namespace {

std::vector<Found> steady(int from, int to, int every, const std::function<double(int)>& error) {
  std::vector<Found> checks;
  for (int at = from; at <= to; at += every) checks.push_back({at, error(at)});
  return checks;
}
std::vector<Found> steady(double error, int to = 1000) {
  return steady(0, to, 100, [error](int) { return error; });
}

constexpr double nan = std::numeric_limits<double>::quiet_NaN(),
                 infinity = std::numeric_limits<double>::infinity();

TEST(Certificate, AsksSmallClustersHoweverLittleMayBeLeft) {
  // Below what a direct solve can tell the checks of large clusters decide; but what it can tell it tells.
  constexpr double fine = 1e-8;
  const auto verdict = [](double small, double large) {
    Situation one{.what = "", .checks = {{0, 1}, {1000, 1e-9}}, .verdict = Verdict::solved};
    one.plain_sweeps = 1e4;  // stiff: the large ones are asked for their velocities
    one.small_errors = {small};
    one.velocity_errors = {large};
    return judged(one, {}, fine);
  };
  EXPECT_EQ(verdict(0, 0).verdict, Verdict::solved);
  EXPECT_EQ(verdict(38, 0).verdict, Verdict::go_on);
  EXPECT_EQ(verdict(1e-5, 0).verdict, Verdict::go_on);
  EXPECT_EQ(verdict(5e-7, 0).verdict, Verdict::solved);
  EXPECT_NEAR(verdict(5e-7, 0).result.unbalance, 5e-7, 1e-9) << "what is told apart is told";
  EXPECT_EQ(verdict(0, 1e-6).verdict, Verdict::go_on);
}

TEST(Certificate, SaysWhatASituationIs) {
  using enum Verdict;
  const Situation table[] = {
      {.what = "small error, walls at rest", .checks = {{0, 1}, {10, 1e-4}}, .verdict = solved},
      {.what = "too large an error", .checks = {{0, 1}, {10, 2e-3}}, .verdict = go_on},
      {.what = "before the first sweep nothing is known", .checks = {{0, 1e-4}}, .verdict = go_on},
      {.what = "but an exact answer is taken", .checks = {{0, 0}}, .verdict = solved},
      {.what = "wall forces still change", .checks = {{0, 1, 1}, {10, 1e-4, 2}}, .verdict = go_on},
      {.what = "the last sweep is done", .checks = {{0, 1}, {10000, 2e-3}}, .verdict = exhausted},
      {.what = "solved by the last sweep", .checks = {{0, 1}, {10000, 1e-4}}, .verdict = solved},
      {.what = "no number", .checks = {{0, 1}, {10, nan}}, .verdict = not_finite},
      {.what = "no number at the end", .checks = {{0, 1}, {10000, nan}}, .verdict = not_finite},
      {.what = "an error without bound", .checks = {{0, 1}, {10, 2e3}}, .verdict = diverged},
      {.what = "which momentum may make", .checks = {{0, 1}, {10, 2e3}}, .verdict = go_on, .plain = false},
      {.what = "an error that stays", .checks = steady(0.1), .verdict = stagnated},
      {.what = "where the method has another way",
       .checks = steady(0.1),
       .verdict = stuck,
       .other_ways = true},
      {.what = "velocities far from the answer",
       .checks = {{0, 1}, {10, 1e-4}},
       .verdict = go_on,
       .plain_sweeps = 1e4,
       .velocity_errors = {0.5}},
      {.what = "a small cluster far from its answer, though nothing else shows it",
       .checks = {{0, 1}, {10, 1e-4}},
       .verdict = go_on,
       .small_errors = {0.5}},
      {.what = "small clusters near it, but walls still change",
       .checks = {{0, 1, 1}, {10, 1e-4, 2}},
       .verdict = go_on,
       .small_errors = {0}},
      {.what = "a small cluster without a number",
       .checks = {{0, 1}, {10, 1e-4}},
       .verdict = go_on,
       .small_errors = {nan}},
      {.what = "a small cluster between walls that close",
       .checks = {{0, 1}, {10, 1e-4}},
       .verdict = impossible,
       .small_errors = {1},
       .answers = AnswerState::jammed},
      {.what = "one that friction holds there",
       .checks = {{0, 1}, {10, 1e-4}},
       .verdict = impossible,
       .small_errors = {1},
       .answers = AnswerState::locked},
      {.what = "beside others that can be put right",
       .checks = {{0, 1}, {10, 1e-4}},
       .verdict = go_on,
       .small_errors = {1},
       .answers = AnswerState::jammed,
       .mends = true},
      {.what = "small clusters can be put right behind the last sweep",
       .checks = {{0, 1}, {10000, 2e-3}},
       .verdict = go_on,
       .small_errors = {1},
       .mends = true,
       .corrects = true},
      {.what = "or where sweeps stand still",
       .checks = steady(0.1),
       .verdict = go_on,
       .small_errors = {1},
       .mends = true,
       .corrects = true},
      {.what = "but not by this method",
       .checks = {{0, 1}, {10000, 2e-3}},
       .verdict = exhausted,
       .small_errors = {1},
       .mends = true},
      {.what = "nor where no answer helps",
       .checks = {{0, 1}, {10000, 2e-3}},
       .verdict = exhausted,
       .small_errors = {1},
       .corrects = true},
      {.what = "nor where they are right, and others are not",
       .checks = steady(0.1),
       .verdict = stagnated,
       .small_errors = {0},
       .mends = true,
       .corrects = true},
      {.what = "small errors under large forces, and velocities far from the answer",
       .checks = {{0, 1}, {10, 1e-4, 1, 0.02}},
       .verdict = go_on,
       .velocity_errors = {0.5}},
      {.what = "velocities near it",
       .checks = {{0, 1}, {10, 1e-4, 1, 0.02}},
       .verdict = solved,
       .velocity_errors = {0.01}},
      {.what = "small errors where they do little work",
       .checks = {{0, 1}, {10, 1e-4, 1, 0.004}},
       .verdict = solved,
       .velocity_errors = {0.5}},
      {.what = "much more work than velocities seem to need",
       .checks = {{0, 1}, {10, 1e-4, 1, 0.6}},
       .verdict = go_on,
       .velocity_errors = {0}},
      {.what = "velocities near it, whatever walls do",
       .checks = {{0, 1, 1}, {10, 1e-4, 2}},
       .verdict = solved,
       .plain_sweeps = 1e4}};
  for (const Situation& situation : table) {
    const Outcome outcome = judged(situation);
    EXPECT_EQ(outcome.verdict, situation.verdict) << situation.what;
    EXPECT_EQ(outcome.result.converged, situation.verdict == solved) << situation.what;
    EXPECT_EQ(outcome.result.diverged, situation.verdict == diverged) << situation.what;
    EXPECT_EQ(outcome.result.stagnated, situation.verdict == stagnated) << situation.what;
  }
}

TEST(Certificate, AThresholdMovedByOneMovesTheVerdict) {
  using enum Verdict;
  struct Case {
    Situation situation;
    std::function<void(CertificateThresholds&)> change;
    Verdict otherwise;
  };
  using T = CertificateThresholds;
  const Situation stiff{.what = "",
                        .checks = {{0, 1}, {10, 1e-4}},
                        .verdict = go_on,
                        .plain_sweeps = 500,
                        .velocity_errors = {1}};
  const auto named = [](std::string what, Situation situation) {
    situation.what = std::move(what);
    return situation;
  };
  const auto falling = [](int at) { return at < 500 ? 0.1 : 0.08; };
  const Case table[] = {
      {{.what = "divergence", .checks = {{0, 1}, {10, 2e3}}, .verdict = diverged},
       [](T& t) { t.divergence = 1e4; },
       go_on},
      {{.what = "patience", .checks = steady(0.1), .verdict = stagnated},
       [](T& t) { t.patience = 2000; },
       go_on},
      {{.what = "stagnation", .checks = steady(0, 1000, 100, falling), .verdict = go_on},
       [](T& t) { t.stagnation = 0.5; },
       stagnated},
      {{.what = "first drift", .checks = {{0, 1, 1}, {2, 1e-4, 1.02}}, .verdict = go_on, .plain_sweeps = 1},
       [](T& t) { t.first_drift = 1; },
       solved},
      {{.what = "tiny",
        .checks = {{0, 1}, {10, 1e-4}},
        .verdict = go_on,
        .contacts = 64,
        .velocity_errors = {1}},
       [](T& t) { t.tiny = 63; },
       solved},
      {{.what = "doubts",
        .checks = {{0, 1}, {10, 1e-4}, {20, 1e-4}},
        .verdict = go_on,
        .small_errors = {infinity, 0}},
       [](T& t) { t.most_doubts = 2; },
       solved},
      {{.what = "growth between doubts",
        .checks = {{0, 1}, {10, 1e-4}, {39, 1e-4}},
        .verdict = go_on,
        .small_errors = {infinity, 0}},
       [](T& t) { t.doubt_growth = 3.9; },
       solved},
      {named("cost of a velocity check", stiff), [](T& t) { t.velocity_check_cost = 501; }, solved},
      {named("stiffness for a size", stiff), [](T& t) { t.stiff_per_contact = 0.501; }, solved},
      {{.what = "settling",
        .checks = {{0, 1}, {10, 1e-2}, {10, 1e-2}, {59, 1e-4}},
        .verdict = go_on,
        .admm_behind = 1},
       [](T& t) { t.settling = 49; },
       solved},
      {{.what = "resolution of a velocity check",
        .checks = {{0, 1}, {10, 1e-4}},
        .verdict = solved,
        .plain_sweeps = 1e4},
       [](T& t) { t.velocity_resolution = 1.1; },
       go_on},
      {{.what = "sweeps in doubt",
        .checks = {{0, 1}, {10, 1e-4, 1, 0.1}, {400, 1e-4, 1, 0.1}},
        .verdict = solved,
        .velocity_errors = {1, 0.01}},
       [](T& t) { t.doubtful = 401; },
       go_on},
      {{.what = "growth between doubts about velocities",
        .checks = {{0, 1}, {300, 1e-4, 1, 0.1}, {600, 1e-4, 1, 0.1}},
        .verdict = solved,
        .velocity_errors = {1, 0.01}},
       [](T& t) { t.doubt_again = 2.1; },
       go_on},
      {{.what = "growth between velocity checks",
        .checks = {{0, 1}, {100, 1e-4}, {125, 1e-4}},
        .verdict = go_on,
        .plain_sweeps = 1e4,
        .velocity_errors = {1, 0}},
       [](T& t) { t.velocity_check_growth = 1.2; },
       solved}};
  for (const Case& row : table) {
    EXPECT_EQ(judged(row.situation).verdict, row.situation.verdict) << row.situation.what;
    CertificateThresholds changed;
    row.change(changed);
    EXPECT_EQ(judged(row.situation, changed).verdict, row.otherwise) << row.situation.what << ", changed";
  }
}

TEST(Certificate, SmallClustersArePutRightAgainAtOnceOnlyIfThatHasHelped) {
  Situation given{.what = "",
                  .checks = {{0, 1}, {10, 1e-4}, {10, 1e-4}},
                  .verdict = Verdict::go_on,
                  .small_errors = {1, 0.4},
                  .newton_behind = 1};
  EXPECT_TRUE(judged(given).correctable);
  given.small_errors = {1, 0.6};
  EXPECT_FALSE(judged(given).correctable);
  given.checks.push_back({20, 1e-4});
  EXPECT_TRUE(judged(given).correctable) << "sweeps have gone on meanwhile";
  given.small_errors = {1, 0.01};
  EXPECT_FALSE(judged(given).correctable) << "within the tolerance nothing is to be mended";
}

TEST(Certificate, VelocitiesAreCheckedOnlyWhereTheStepMayEnd) {
  Situation given{
      .what = "", .checks = {{0, 1}, {10, 0.1}, {20, 0.01}}, .verdict = Verdict::go_on, .plain_sweeps = 1e4};
  EXPECT_EQ(judged(given).velocity_checks, 0u);
  given.checks.push_back({30, 1e-4});
  EXPECT_EQ(judged(given).velocity_checks, 1u);
}

TEST(Certificate, AResidualThatHasFallenFarPromisesABalanceThatIsChecked) {
  // At 100 sweeps velocities are 0.2 off; a residual a tenth of that then lets expect 0.02, within 0.05.
  const Situation given{.what = "",
                        .checks = {{0, 1}, {100, 1e-4}, {110, 1e-5}},
                        .verdict = Verdict::solved,
                        .plain_sweeps = 1e4,
                        .velocity_errors = {0.2, 0.01}};
  const Outcome outcome = judged(given);
  EXPECT_EQ(outcome.velocity_checks, 2u);
  EXPECT_EQ(outcome.verdict, Verdict::solved);
}

TEST(Certificate, ForgivesPlainSweepsWhatOtherSweepsMadeWorse) {
  SolverSettings settings;
  KnownProblem problem(10, {0});
  for (const bool forgiven : {false, true}) {
    Certificate certificate(settings);
    certificate.begin({.rounding_velocity = 0, .wall_pushes = {0}});
    certificate.judge(sums_of({0, 1}, 1000), {.iterations = 0, .plain = false}, problem);
    certificate.judge(sums_of({10, 2e3}, 1000), {.iterations = 10, .plain = false}, problem);
    if (forgiven) certificate.forgive();
    EXPECT_EQ(certificate.judge(sums_of({20, 2e3}, 1000), {.iterations = 20}, problem),
              forgiven ? Verdict::go_on : Verdict::diverged);
  }
}

TEST(Certificate, RoundingOfVelocitiesIsNoError) {
  SolverSettings settings;
  KnownProblem problem(10, {0});
  Certificate certificate(settings);
  certificate.begin({.rounding_velocity = 1e-12, .wall_pushes = {0}});
  CheckSums sums = sums_of({0, 1e-16, 0}, 100);
  sums.error.impulse2 = 0;
  certificate.judge(sums, {.iterations = 0}, problem);
  EXPECT_LT(certificate.result().error_rms, 1e-4);
  EXPECT_GT(certificate.result().error_rms, 0);
  // Rows of grains that fly side by side: what rounding leaves at each of 100 contacts no sweep can mend.
  sums.error.residual2 = 100 * 1e-24;
  EXPECT_EQ(certificate.judge(sums, {.iterations = 10}, problem), Verdict::solved);
  sums.error.residual2 *= 4;
  EXPECT_EQ(certificate.judge(sums, {.iterations = 20}, problem), Verdict::go_on);
}

TEST(Certificate, AStepIsCertifiedOnlyWithItsMomentumAndPositions) {
  const SolverSettings settings;
  IterationResult result;
  result.converged = true;
  const double tolerance = settings.balance_tolerance;
  EXPECT_TRUE(certified(result, tolerance, 0, settings.overlap_tolerance, settings));
  EXPECT_FALSE(certified(result, 1.01 * tolerance, 0, 0, settings));
  EXPECT_FALSE(certified(result, nan, 0, 0, settings));
  EXPECT_FALSE(certified(result, 0, 1, 0, settings));
  EXPECT_FALSE(certified(result, 0, 0, 1.01 * settings.overlap_tolerance, settings));
  EXPECT_FALSE(certified(result, 0, 0, nan, settings));
  result.converged = false;
  EXPECT_FALSE(certified(result, 0, 0, 0, settings));
}

}  // namespace
}  // namespace talus::certificate_test
