#pragma once

/// Walls that appear as a stage begins.

#include <string>

#include "runtime/graph/communicator.hpp"
#include "runtime/step/setup.hpp"
#include "runtime/step/state.hpp"

namespace talus {

/// A mesh pushes only what is in front of its triangles: a centre that is already inside would never be
/// pushed out. Throws RunawayError, in which `step` is named, where a surface that appears with the stage has
/// such a grain, or a clump with such a ball, in its solid. Grains that come and go with the step have done
/// so. Collective, on all ranks alike.
void demand_grains_outside(const Stage& stage, const std::string& step, const StepState& state,
                           const graph::Communicator& ranks);

}  // namespace talus
