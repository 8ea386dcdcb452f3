#pragma once

/// How near a stage is to its end.

#include <cstdint>

#include "runtime/step/setup.hpp"
#include "runtime/step/time_step.hpp"

namespace talus {

/// Progress of a stage after a step.
struct StageProgress {
  std::int64_t steps = 0;   ///< done
  const StageClock& clock;  ///< of a stage that chooses its time steps
  double strain = 0;        ///< along the axis of StageEnd::strain
  double sheared = 0;       ///< path of the cell's shear in the stage
  double held = 0;          ///< time for which the bound on equilibrium has held without a break [s]
  double fall_time = 0;     ///< [s] (step_report.hpp)
};

struct StageDone {
  double fraction = 0;  ///< part of the stage done by its nearest end condition; >= 1 when it has ended
  const char* by = "";  ///< that condition: "steps", "time", "strain", "shear_strain" or
                        ///< "equilibrium"
};

StageDone stage_done(const Stage& stage, const StageProgress& progress);

}  // namespace talus
