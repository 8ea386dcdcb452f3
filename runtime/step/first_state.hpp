#pragma once

#include "kernels/bodies/bodies.hpp"
#include "runtime/graph/communicator.hpp"
#include "runtime/step/checkpoint.hpp"
#include "runtime/step/setup.hpp"
#include "runtime/step/state.hpp"

namespace talus {

/// The state before the first step of a simulation: the bodies of this rank, sorted if there is one subdomain
/// (several are dealt out by that step), walls and clumps of the setup, and room for what steps write. Throws
/// std::invalid_argument when setup and bodies make no sense together. Collective.
StepState first_state(const Setup& setup, Bodies bodies, const graph::Communicator& ranks);

/// The state before the first step after a checkpoint; its walls have the loads of the stage of that step.
/// Throws and is collective likewise.
StepState restored_state(const Setup& setup, const Checkpoint& from, const graph::Communicator& ranks);

}  // namespace talus
