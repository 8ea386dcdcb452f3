#pragma once

/// What is said of walls behind a step.

#include <span>
#include <vector>

#include "runtime/step/frame.hpp"
#include "runtime/step/setup.hpp"
#include "runtime/step/state.hpp"

namespace talus {

/// Of each wall. `impulse_time`: of the last step [s].
std::vector<WallReport> wall_reports(const StepState& state, double impulse_time);

/// Of each group the sum over its walls, whose reports these are: forces, torques about the group's point,
/// work.
std::vector<WallReport> group_reports(const Setup& setup, const StepState& state,
                                      std::span<const WallReport> walls);

}  // namespace talus
