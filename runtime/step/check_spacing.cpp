#include "runtime/step/check_spacing.hpp"

#include <algorithm>
#include <cmath>

namespace talus {

int sweeps_until_check(const ErrorHistory& history, const Course& course, int start,
                       const SolverSettings& settings, int exchange) {
  const int all = history.last().iterations, done = all - start, every = settings.check_every;
  constexpr int trusted = MomentumParameters{}.trusted_sweeps;
  int sweeps = course.plan.kind == SweepKind::momentum ? std::clamp(done, every, std::max(trusted, every))
                                                       : std::max(every, done / 2);
  const double error = history.last().error_rms;
  const ErrorCheck* const before = history.before_last(course.begun, every);
  if (before && error > settings.tolerance && error < before->error_rms) {
    const double log_error = std::log(before->error_rms / error),
                 log_missing = std::log(error / settings.tolerance);
    const int then = before->iterations - start;
    const double to_go = then > 0 ? done * std::expm1(log_missing / log_error * std::log(double(done) / then))
                                  : done * log_missing / log_error;
    sweeps = static_cast<int>(std::ceil(std::min<double>(sweeps, to_go)));
  }
  sweeps = std::max(least_sweeps, sweeps);
  sweeps = (sweeps + exchange - 1) / exchange * exchange;
  return std::min(sweeps, settings.max_iterations - all);
}

}  // namespace talus
