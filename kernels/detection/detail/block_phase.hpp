#pragma once

#include "kernels/detection/narrow_phase.hpp"
#include "kernels/law/gap_law.hpp"

namespace talus::detail {

/// The contacts of a chunk of blocks, in order of candidates, with their levers and balls. The restitution is
/// that of each pair; impulses and friction are left to narrow_chunk.
void narrow_blocks(const NarrowPhase& in, const GapRule& rule, const Candidates& candidates,
                   const Chunks& chunks, std::size_t chunk, Contacts& contacts);

/// Cuts the contacts of a chunk, which stand up to place `end`, into full groups and a rest. For chunks in
/// which any contacts may share a group.
void close_groups(const Chunks& chunks, std::size_t chunk, std::size_t end, Contacts& contacts);

}  // namespace talus::detail
