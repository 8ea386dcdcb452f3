#pragma once

/// A step's loop in the words of graph::plan_loop: chunks are work, subdomains here are groups.

#include "runtime/graph/loop_plan.hpp"
#include "runtime/step/gluing.hpp"
#include "runtime/step/setup.hpp"
#include "runtime/step/state.hpp"

namespace talus {

/// Expected work of a chunk, in contacts.
std::uint32_t work_of_chunk(const StepState& state, std::size_t c);
/// Where a chunk lies among those of this rank. Bodies stand in Morton order, subdomain after subdomain, so
/// its first body says; chunks at walls go with the grains beside them.
std::uint32_t place_of_chunk(const Chunks& chunks, std::size_t c);

/// Behind Gluing::plan_tree(), with the contacts of the narrow phase.
graph::LoopSpec loop_spec(const StepState& state, const Gluing& gluing, const DecompositionSettings& settings,
                          const graph::Communicator& ranks, int threads);

}  // namespace talus
