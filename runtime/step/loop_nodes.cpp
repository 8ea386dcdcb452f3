#include "runtime/step/loop_nodes.hpp"

#include <utility>

namespace talus {

namespace {

/// Chunks at glued walls belong to the border where the subdomain has no tell. `push`: all chunks act on what
/// goes through the root, so those inside belong to the border, too.
graph::LoopWork::Side side_of(ChunkSide side, bool tells, bool push) {
  using enum graph::LoopWork::Side;
  switch (side) {
    case ChunkSide::wall:
      return tells ? early : border;
    case ChunkSide::border:
      return border;
    case ChunkSide::inside:
      return push ? border : inside;
    case ChunkSide::late:
      break;
  }
  return late;
}

}  // namespace

std::uint32_t work_of_chunk(const StepState& state, std::size_t c) {
  return 1 + static_cast<std::uint32_t>(state.contacts.count[c]);
}

std::uint32_t place_of_chunk(const Chunks& chunks, std::size_t c) {
  return static_cast<std::uint32_t>(chunks.bodies[static_cast<std::size_t>(chunks.body_begin[c])]);
}

graph::LoopSpec loop_spec(const StepState& state, const Gluing& gluing, const DecompositionSettings& settings,
                          const graph::Communicator& ranks, int threads) {
  const Chunks& chunks = state.chunks;
  graph::LoopSpec spec;
  spec.in_colours = state.decomposition.in_colours();
  spec.overlap = settings.overlap;
  spec.collects = gluing.collects();
  spec.only_first_thread_exchanges = ranks.ranks() > 1 && !ranks.any_thread();
  spec.threads = threads;
  spec.rank = ranks.rank();
  for (const SubdomainPlace e : state.decomposition.here.indices()) {
    std::vector<std::uint32_t> readers;
    for (const SubdomainPlace reader : gluing.readers_here(e))
      readers.push_back(static_cast<std::uint32_t>(reader.value()));
    spec.groups.push_back({.colour = static_cast<char>(gluing.subdomain_colour(e)),
                           .exchanges = gluing.needed(),
                           .tells = gluing.tells(e),
                           .readers = std::move(readers)});
  }
  for (std::size_t c = 0; c < chunks.size(); ++c) {
    const SubdomainPlace e(chunks.subdomain[c]);
    spec.work.push_back({.side = side_of(chunks.side[c], gluing.tells(e), state.cell.loaded()),
                         .group = static_cast<std::uint32_t>(e.value()),
                         .colour = static_cast<std::uint32_t>(chunks.colour[c]),
                         .weight = work_of_chunk(state, c),
                         .place = place_of_chunk(chunks, c)});
  }
  spec.offset.assign(chunks.conflict_begin.begin(), chunks.conflict_begin.end());
  spec.neighbour.assign(chunks.conflicts.begin(), chunks.conflicts.end());
  return spec;
}

}  // namespace talus
