#pragma once

/// Whether grains are where their velocities and the correction of overlaps take them.

#include "apps/study_certificate/step_problem.hpp"

namespace talus::audit {

/// How far a grain is from where its velocities take it, and what may shift it that far.
struct UnexplainedShift {
  double way = 0;      ///< the largest |x+ - x- - h (u- + u+)/2| [m]
  double granted = 0;  ///< [m]
  bool within(double times) const { return way <= times * granted; }  ///< false also where it is no number
};

/// Granted are `part` (`overlap_correction`) of the overlaps in the middle of the step, from where grains
/// rebound, or that the velocities would leave at its end, twice their sum, and rounding. Nothing is asked in
/// a cell, where positions wrap. `input`: the step without what happens in it.
UnexplainedShift unexplained_shift(const StepInput& input, double part, const Frame& after);

}  // namespace talus::audit
