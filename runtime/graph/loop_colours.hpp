#pragma once

/// The colours of the nodes of one rank's iteration: chunks at the border of each subdomain, its publish,
/// chunks inside, glue. A rank of one thread does all this but the gluing for one subdomain after another, so
/// that it stays with one while that is in the cache. Threads go through all of them colour by colour: two
/// may have parts of one subdomain, and the one that comes to it late would keep the other waiting. As
/// subdomains share no grain, the order among them changes no bit.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace talus::graph {

/// A chunk by what decides when its turn comes.
struct ChunkTurn {
  bool inside;              ///< no grain of it stands in another subdomain
  std::uint32_t subdomain;  ///< or its place among those of the rank
  std::uint32_t colour;  ///< counts within its side of the border of its subdomain, whatever it begins with
};

/// Even ones, without gaps; odd ones are left to what the tree of ranks does between the last publish and
/// glue (tree.hpp).
struct LoopColours {
  std::vector<std::uint32_t> chunk;    ///< as the turns that were given
  std::vector<std::uint32_t> publish;  ///< per subdomain of the rank, behind its border; ascending
  std::uint32_t glue = 0;              ///< behind everything, or before all insides without overlap
};
LoopColours loop_colours(std::span<const ChunkTurn> turns, std::size_t subdomains, bool overlap, int threads);

}  // namespace talus::graph
