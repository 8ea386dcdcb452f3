#include "runtime/step/stage_end.hpp"

#include <cmath>

namespace talus {

StageDone stage_done(const Stage& stage, const StageProgress& progress) {
  const StageEnd& end = stage.end;
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
  if (end.strain) consider("strain", std::abs(progress.strain) / *end.strain);
  if (end.shear_strain) consider("shear_strain", progress.sheared / *end.shear_strain);
  if (progress.held > 0 && progress.held >= end.equilibrium_hold * progress.fall_time)
    consider("equilibrium", 1);
  return nearest;
}

}  // namespace talus
