#pragma once

/// Reports of walls after a step.

#include <span>
#include <vector>

#include "runtime/step/frame.hpp"
#include "runtime/step/setup.hpp"
#include "runtime/step/state.hpp"

namespace talus {

/// A report of each wall. `impulse_time`: of the last step [s].
std::vector<WallReport> wall_reports(const StepState& state, double impulse_time);

/// A report of each group: sums over its walls of forces, torques about the group's point, and work. `walls`:
/// the reports of all walls.
std::vector<WallReport> group_reports(const Setup& setup, const StepState& state,
                                      std::span<const WallReport> walls);

}  // namespace talus
