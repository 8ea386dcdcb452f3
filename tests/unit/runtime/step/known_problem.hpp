#pragma once

/// A certificate before problems whose answers are known.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "kernels/clusters/cluster_work.hpp"
#include "runtime/step/certificate.hpp"

namespace talus::certificate_test {

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
  bool several_large_clusters() override { return several && largest_work.has_value(); }
  double large_work(double speed, double interest) override {
    floors = {speed, interest};
    return *largest_work;
  }
  SmallError small_error(double enough, int) override {
    const double error = small_errors_[std::min(small_asked_++, small_errors_.size() - 1)];
    return {std::isnan(error) ? error : std::max(enough, error),
            std::isinf(error) ? std::max(answers, AnswerState::missing) : answers, mends, exchanged};
  }
  double large_error(double enough) override {
    const std::size_t which = std::min(asked_++, velocity_errors_.size() - 1);
    return std::max(enough, velocity_errors_[which]);
  }
  VelocityErrorMemory& velocity_errors() override { return memory_; }
  double quantile_error(double) override { return 0; }
  WorstErrors worst_errors() override { return {}; }
  std::size_t asked() const { return asked_; }
  std::size_t small_asked() const { return small_asked_; }
  AnswerState answers = AnswerState::found;  ///< what is known of small clusters besides
  bool mends = false;
  /// By them: next to nothing; of no mass it is not known.
  Exchanged exchanged = {.energy = 0, .mass = 1e-12};
  std::optional<double> largest_work;  ///< of large clusters, where one is to be weighed by itself
  bool several = true;                 ///< of them
  ExchangeFloors floors;               ///< that it was last asked for with

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
  AnswerState answers = AnswerState::found;
  bool mends = false;
  bool corrects = false;  ///< the method puts small clusters right
};

inline CheckSums sums_of(const Found& found, std::int64_t contacts) {
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
inline Outcome judged(const Situation& given, const CertificateThresholds& thresholds = {},
                      double balance_tolerance = 0.05) {
  SolverSettings settings;
  settings.max_iterations = 10000;
  settings.balance_tolerance = balance_tolerance;
  Certificate certificate(settings, thresholds);
  certificate.begin({.rounding_velocity = 0, .wall_pushes = {0}});
  KnownProblem problem(given.plain_sweeps, given.velocity_errors, given.small_errors);
  problem.answers = given.answers;
  problem.mends = given.mends;
  Outcome outcome;
  for (std::size_t k = 0; k < given.checks.size(); ++k) {
    outcome.verdict = certificate.judge(sums_of(given.checks[k], given.contacts),
                                        {.iterations = given.checks[k].iterations,
                                         .seconds = 0,
                                         .plain = given.plain,
                                         .other_ways = given.other_ways,
                                         .corrects = given.corrects},
                                        problem);
    if (static_cast<int>(k) == given.admm_behind) certificate.solved_by_admm({});
    if (static_cast<int>(k) == given.newton_behind) certificate.corrected();
    outcome.correctable = certificate.correctable();
  }
  outcome.result = certificate.result();
  outcome.velocity_checks = problem.asked();
  return outcome;
}

}  // namespace talus::certificate_test
