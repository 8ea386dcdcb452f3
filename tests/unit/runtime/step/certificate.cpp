// What the certificate says of a step, and that each of its thresholds has a part in it.

#include "runtime/step/certificate.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

namespace talus::certificate_test {
namespace {

/// A problem with known answers, those of checks of large and of small clusters given in turn, the last one
/// again and again. Without errors of small clusters there are none; an infinite one has found no answer.
class KnownProblem : public WholeProblem {
 public:
  KnownProblem(double plain_sweeps, std::vector<double> velocity_errors,
               std::vector<double> small_errors = {})
      : plain_sweeps_(plain_sweeps),
        velocity_errors_(std::move(velocity_errors)),
        small_errors_(std::move(small_errors)) {}
  double plain_sweeps_needed() override { return plain_sweeps_; }
  double speed() const override { return 1; }
  bool small_clusters() override { return !small_errors_.empty(); }
  bool large_clusters() override { return true; }
  SmallError small_error(double enough, int) override {
    const double error = small_errors_[std::min(small_asked_++, small_errors_.size() - 1)];
    return {std::isnan(error) ? error : std::max(enough, error), !std::isinf(error), mends, jammed,
            exchanged};
  }
  double large_error(double enough) override {
    const std::size_t which = std::min(asked_++, velocity_errors_.size() - 1);
    return std::max(enough, velocity_errors_[which]);
  }
  VelocityErrorMemory& velocity_errors() override { return memory_; }
  double quantile_error(double) override { return 0; }
  WorstErrors worst_errors() override { return {}; }
  std::size_t asked() const { return asked_; }
  bool jammed = false, mends = false;  ///< what small clusters are besides
  Exchanged exchanged;                 ///< by them

 private:
  double plain_sweeps_;
  std::vector<double> velocity_errors_, small_errors_;
  std::size_t asked_ = 0, small_asked_ = 0;
  VelocityErrorMemory memory_;
};

/// What a check finds: the relative error, the impulse of the one wall [N s], and the work of errors [J].
struct Found {
  int iterations;
  double error;
  double wall = 1;
  double work = 0;  ///< of the contacts' errors, where contacts exchange 1 J
};

struct Situation {
  std::string what;
  std::vector<Found> checks;
  Verdict verdict;  ///< at the last check
  std::int64_t contacts = 1000;
  double plain_sweeps = 10;
  std::vector<double> velocity_errors = {0};
  bool plain = true, other_ways = false;
  int admm_behind = -1;  ///< check behind which ADMM is called
  std::vector<double> small_errors = {};
  int newton_behind = -1;  ///< check behind which a Newton step is taken
  bool jammed = false, mends = false;
};

CheckSums sums_of(const Found& found, std::int64_t contacts) {
  CheckSums sums;
  sums.error.impulse2 = 1;
  sums.error.residual2 = found.error * found.error;
  sums.error.contacts = contacts;
  sums.error.work = found.work;
  sums.exchanged = {.energy = 1, .mass = 1};
  sums.wall_impulse = {Vec3(found.wall, 0, 0)};
  return sums;
}

struct Outcome {
  Verdict verdict = Verdict::go_on;
  IterationResult result;
  std::size_t velocity_checks = 0;
  bool correctable = false;  ///< behind the last check
};

/// Tolerances 1e-3 on the error and 0.05 on the balance; at most 10,000 sweeps.
Outcome judged(const Situation& given, const CertificateThresholds& thresholds = {},
               double balance_tolerance = 0.05) {
  SolverSettings settings;
  settings.max_iterations = 10000;
  settings.balance_tolerance = balance_tolerance;
  Certificate certificate(settings, thresholds);
  certificate.begin({.rounding_velocity = 0, .wall_pushes = {0}});
  KnownProblem problem(given.plain_sweeps, given.velocity_errors, given.small_errors);
  problem.jammed = given.jammed;
  problem.mends = given.mends;
  Outcome outcome;
  for (std::size_t k = 0; k < given.checks.size(); ++k) {
    outcome.verdict = certificate.judge(sums_of(given.checks[k], given.contacts),
                                        {.iterations = given.checks[k].iterations,
                                         .seconds = 0,
                                         .plain = given.plain,
                                         .other_ways = given.other_ways},
                                        problem);
    if (static_cast<int>(k) == given.admm_behind) certificate.solved_by_admm({});
    if (static_cast<int>(k) == given.newton_behind) certificate.corrected();
    outcome.correctable = certificate.correctable();
  }
  outcome.result = certificate.result();
  outcome.velocity_checks = problem.asked();
  return outcome;
}

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
       .jammed = true},
      {.what = "beside others that can be put right",
       .checks = {{0, 1}, {10, 1e-4}},
       .verdict = go_on,
       .small_errors = {1},
       .jammed = true,
       .mends = true},
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

TEST(Certificate, EveryThresholdDecidesASituation) {
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

/// Verdict on a work of errors of 0.02 J where grains of 1 kg exchange 1 J, velocities being wrong.
Verdict doubted(Certificate::Scales scales, std::vector<double> impulses, Exchanged by_small = {},
                SolverSettings settings = {.balance_tolerance = 0.05}) {
  Certificate certificate(settings);
  scales.wall_pushes.assign(impulses.size(), 0);
  certificate.begin(std::move(scales));
  KnownProblem problem(1, {0.5}, {0});
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
  EXPECT_EQ(doubted({.wall_inv_masses = {0.25}}, {5}, {.energy = 0.9, .mass = 0.5}), go_on)
      << "what small clusters exchange is none of it";
}

TEST(Certificate, BoundsVelocitiesMoreLooselyWithFrictionOrAsTheUserSays) {
  using enum Verdict;
  // A work of 0.02 is taken for an error of 0.2.
  EXPECT_EQ(doubted({}, {}), go_on);
  EXPECT_EQ(doubted({.friction = true}, {}), solved) << "ten times the bound of 0.05";
  EXPECT_EQ(doubted({.friction = true}, {}, {}, {.velocity_tolerance = 0.1}), go_on);
  EXPECT_EQ(doubted({}, {}, {}, {.velocity_tolerance = 0.3}), solved);
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
