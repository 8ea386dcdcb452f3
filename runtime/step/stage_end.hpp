#pragma once

/// How near a stage is to its end.

#include <array>
#include <cstdint>

#include "runtime/step/setup.hpp"
#include "runtime/step/time_step.hpp"

namespace talus {

/// What a step says of the state that the ends of its stage look at.
struct StageStep {
  double time_step = 0;       ///< [s]
  double shear = 0;           ///< path of the cell's shear in it
  double stress_ratio = 0;    ///< q/p of the contacts, q = root of 3/2 s : s; 0 without p
  double solid_fraction = 0;  ///< 0 where nothing closes the volume
  double inertial_time = 0;   ///< d root of density over p [s]; 0 without p
  double shear_rate = 0;      ///< of the cell [1/s]
};

/// What those ends remember of the steps of a stage (docs/theory.md, "Ends of stages"). A checkpoint keeps
/// it.
struct StageMemory {
  static constexpr std::size_t watched = 2;  ///< stress ratio, solid fraction

  double stress_ratio = 0;  ///< of the last step
  /// Inertial times for which the inertial number has been at most, and at least, its bound without a break.
  double slow = 0, fast = 0;
  double window = 0;   ///< part of the present window that is done
  double weight = 0;   ///< time in it [s]
  double windows = 0;  ///< that are complete
  double drift = 0;    ///< largest change of a mean from the window before last to the last one
  std::array<double, watched> sums{}, means{};  ///< over the present window [s], of the last one

  void add(const StageEnd& end, const StageStep& step);
  bool steady(const StageEnd& end) const { return windows >= 2 && drift <= end.steady.value_or(-1); }

  /// visit(name, member) for each member of a memory, which may be const.
  template <class Memory, class Visit>
  static void each_number(Memory& memory, const Visit& visit) {
    visit("end_stress_ratio", memory.stress_ratio);
    visit("end_slow", memory.slow);
    visit("end_fast", memory.fast);
    visit("end_window", memory.window);
    visit("end_weight", memory.weight);
    visit("end_windows", memory.windows);
    visit("end_drift", memory.drift);
    visit("end_sum_of_ratio", memory.sums[0]);
    visit("end_sum_of_fraction", memory.sums[1]);
    visit("end_mean_ratio", memory.means[0]);
    visit("end_mean_fraction", memory.means[1]);
  }
};

/// Progress of a stage after a step.
struct StageProgress {
  std::int64_t steps = 0;   ///< done
  const StageClock& clock;  ///< of a stage that chooses its time steps
  double strain = 0;        ///< along the axis of StageEnd::strain
  double sheared = 0;       ///< path of the cell's shear in the stage
  double held = 0;          ///< time for which the bound on equilibrium has held without a break [s]
  double fall_time = 0;     ///< [s] (step_report.hpp)
  const StageMemory& memory;
};

struct StageDone {
  double fraction = 0;  ///< part of the stage done by its nearest end condition; >= 1 when it has ended
  const char* by = "";  ///< that condition, by its key in the scene: "steps", "time", ...
};

StageDone stage_done(const Stage& stage, const StageProgress& progress);

}  // namespace talus
