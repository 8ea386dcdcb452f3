#pragma once

/// Walls that appear as a stage begins.

#include <string>

#include "runtime/graph/communicator.hpp"
#include "runtime/step/setup.hpp"
#include "runtime/step/state.hpp"

namespace talus {

/// Throws RunawayError, in which `step` is named, where a surface that appears with the stage is that of a
/// solid, of a mesh above all, in which the centre of a grain lies, or of a ball of a clump, that touches the
/// surface nowhere: contacts know what comes through a surface, and none would lead out of there. Collective,
/// on all ranks alike.
void demand_grains_outside(const Stage& stage, const std::string& step, const StepState& state,
                           const graph::Communicator& ranks);

}  // namespace talus
