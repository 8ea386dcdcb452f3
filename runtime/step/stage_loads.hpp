#pragma once

/// What a stage prescribes when it begins, and what it loads walls with in a step.

#include <span>
#include <vector>

#include "kernels/shapes/walls.hpp"
#include "runtime/step/setup.hpp"
#include "runtime/step/state.hpp"
#include "runtime/step/step_report.hpp"

namespace talus {

/// Walls that the stage names get its loads; others keep theirs.
void take_loads(const Stage& stage, std::span<Wall> walls);

/// Gives a wall the velocity with which its load comes into force. `wall` is one of `walls`. Throws
/// std::invalid_argument when it is pushed with a pressure and has no face.
void put_load(Wall& wall, const std::vector<Wall>& walls, const Domain& domain);

/// Applied forces, gains and free velocities of the walls for a step. Throws RunawayError, in which the step
/// is named, when a pressure has lost its face.
void apply_loads(const StepParameters& parameters, const StepName& step, StepState& state);

/// `now` with the gravity and laws of the stage, and what follows from them; time step and distances stay.
StepParameters parameters_of(const Setup& setup, const Stage& stage, StepParameters now);

}  // namespace talus
