#pragma once

/// The colours of the nodes of one rank's iteration: chunks at the border of its subdomains, publish, chunks
/// inside, glue. A rank of one thread goes through one subdomain after another, so that it stays with one
/// while that is in the cache. Threads go through all of them colour by colour: two may have parts of one
/// subdomain, and the one that comes to it late would keep the other waiting. As subdomains share no grain,
/// the order among them changes no bit.

#include <compare>
#include <cstdint>
#include <span>
#include <vector>

namespace talus::graph {

/// A chunk by what decides when its turn comes.
struct ChunkTurn {
  bool inside;              ///< no grain of it stands in another subdomain
  std::uint32_t subdomain;  ///< or its place among those of the rank
  std::uint32_t colour;  ///< counts within its side of the border of its subdomain, whatever it begins with
  auto operator<=>(const ChunkTurn&) const = default;
};

/// Chunks have even colours, without gaps; odd ones are left to what the tree of ranks does between publish
/// and glue (tree.hpp).
struct LoopColours {
  std::vector<std::uint32_t> chunk;  ///< as the turns that were given
  std::uint32_t publish = 0;         ///< behind the border
  std::uint32_t glue = 0;            ///< behind the inside, or before it without overlap
};
LoopColours loop_colours(std::span<const ChunkTurn> turns, bool overlap, int threads);

}  // namespace talus::graph
