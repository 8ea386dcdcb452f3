#include "runtime/step/stage_end.hpp"

#include <algorithm>
#include <cmath>

namespace talus {

namespace {

/// Sums of what steps add may fall short of 1 by their rounding.
constexpr double nearly_whole = 1 - 1e-9;

/// Part of a window of the steady state that a step takes.
double part_of_window(const StageEnd& end, const StageStep& step) {
  return end.steady_time ? step.time_step / *end.steady_time : step.shear / end.steady_strain;
}

}  // namespace

void StageMemory::add(const StageEnd& end, const StageStep& step) {
  stress_ratio = step.stress_ratio;
  const double number = step.shear_rate * step.inertial_time;
  const double passed = step.inertial_time > 0 ? step.time_step / step.inertial_time : 0;
  const bool known = step.inertial_time > 0;
  slow = known && end.inertial_below && number <= *end.inertial_below ? slow + passed : 0;
  fast = known && end.inertial_above && number >= *end.inertial_above ? fast + passed : 0;
  if (!end.steady) return;
  window += part_of_window(end, step);
  weight += step.time_step;
  sums[0] += step.time_step * step.stress_ratio;
  sums[1] += step.time_step * step.solid_fraction;
  if (window < nearly_whole) return;
  window = 0;
  // Without a stress in any step, as before grains meet, nothing is said of a steady state.
  if (sums[0] == 0) {
    windows = weight = sums[1] = 0;
    return;
  }
  drift = 0;
  for (std::size_t k = 0; k < watched; ++k) {
    const double mean = sums[k] / weight;
    drift = std::max(drift, std::abs(mean - means[k]));
    means[k] = mean;
    sums[k] = 0;
  }
  windows += 1;
  weight = 0;
}

StageDone stage_done(const Stage& stage, const StageProgress& progress) {
  const StageEnd& end = stage.end;
  const StageMemory& memory = progress.memory;
  const auto steps = static_cast<double>(progress.steps);
  StageDone nearest;
  const auto consider = [&](const char* by, double fraction) {
    if (fraction > nearest.fraction) nearest = {fraction, by};
  };
  if (end.steps) consider("steps", *end.steps > 0 ? steps / static_cast<double>(*end.steps) : 1.0);
  if (end.time)
    consider("time", stage.chooses_time_step ? progress.clock.fraction()
                                             : steps / steps_in(*end.time, stage.time_step));
  if (progress.steps == 0) return nearest;
  const auto consider_path = [&](const char* by, double fraction) {
    consider(by, fraction >= nearly_whole ? std::max(fraction, 1.0) : fraction);
  };
  if (end.strain) consider_path("strain", std::abs(progress.strain) / *end.strain);
  if (end.shear_strain) consider_path("shear_strain", progress.sheared / *end.shear_strain);
  if (progress.held > 0 && progress.held >= end.equilibrium_hold * progress.fall_time)
    consider("equilibrium", 1);
  if (end.stress_ratio) consider("stress_ratio", memory.stress_ratio / *end.stress_ratio);
  if (memory.slow > 0 && memory.slow >= end.inertial_hold) consider("inertial_below", 1);
  if (memory.fast > 0 && memory.fast >= end.inertial_hold) consider("inertial_above", 1);
  if (memory.steady(end)) consider("steady", 1);
  return nearest;
}

}  // namespace talus
