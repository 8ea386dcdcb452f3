#pragma once

#include "kernels/bodies/bodies.hpp"
#include "runtime/graph/communicator.hpp"
#include "runtime/step/checkpoint.hpp"
#include "runtime/step/setup.hpp"
#include "runtime/step/state.hpp"

namespace talus {

/// What the first step of a simulation finds: the bodies of this rank, sorted where there is one subdomain
/// (several are dealt out by that step), walls and clumps of the setup, and room for what steps write. Throws
/// std::invalid_argument when setup and bodies make no sense together. Collective.
StepState first_state(const Setup& setup, Bodies bodies, const graph::Communicator& ranks);

/// What the first step behind a checkpoint finds, walls with the loads of the stage that it stands in. Throws
/// and is collective likewise.
StepState restored_state(const Setup& setup, const Checkpoint& from, const graph::Communicator& ranks);

}  // namespace talus
