#pragma once

/// Describes a step's loop for graph::plan_loop: chunks are work, subdomains of this rank are groups.

#include "runtime/graph/loop_plan.hpp"
#include "runtime/step/gluing.hpp"
#include "runtime/step/setup.hpp"
#include "runtime/step/state.hpp"

namespace talus {

/// Expected work of a chunk, in contacts.
std::uint32_t work_of_chunk(const StepState& state, std::size_t c);
/// Place of a chunk among those of this rank: the slot of its first body, since slots are in Morton order,
/// subdomain after subdomain. Chunks at walls thus stand beside those of the grains near them.
std::uint32_t place_of_chunk(const Chunks& chunks, std::size_t c);

/// After Gluing::plan_tree(), with the contacts of the narrow phase.
graph::LoopSpec loop_spec(const StepState& state, const Gluing& gluing, const DecompositionSettings& settings,
                          const graph::Communicator& ranks, int threads);

}  // namespace talus
