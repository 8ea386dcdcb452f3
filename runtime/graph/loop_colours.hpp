#pragma once

/// The colours of the nodes of one rank's iteration: of each subdomain early chunks, tell, chunks at the
/// border, publish, chunks inside; glue. A rank of one thread does all this but the gluing for one subdomain
/// after another, so that it stays with one while that is in the cache. Threads go through all of them colour
/// by colour: two may have parts of one subdomain, and the one that comes to it late would keep the other
/// waiting. As subdomains share no grain, the order among them changes no bit.
///
/// Where there are other ranks, what is early of all and tell come first. Where subdomains have colours,
/// those of the first come next, then those of each later subdomain colour with chunks inside, take, the late
/// border and publish: each hides the messages of the others. Threads, and a rank that has subdomains of the
/// first subdomain colour only, leave their inside to the end. A rank alone has nothing to hide, and stays
/// with each subdomain.
///
/// Nobody waits for ever: a tell waits for no message, what goes up the tree of ranks for tells, a take of
/// subdomain colour t for publishes of subdomain colours before t, and all these stand before what waits for
/// more: up before take, take of subdomain colour t before that of t + 1, and down, which above may stand
/// behind takes, behind every publish. A publish where nothing has colours waits for nobody, nor down but for
/// ups.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/graph/tree.hpp"

namespace talus::graph {

/// A chunk by what decides when its subdomain colour comes.
struct ChunkOrder {
  enum Side {
    early,   ///< before tell
    border,  ///< of the first subdomain colour
    inside,  ///< no grain of it stands in another subdomain
    late,    ///< the border of a later subdomain colour
  } side;
  std::uint32_t subdomain;  ///< or its place among those of the rank
  std::uint32_t colour;     ///< counts within its side of its subdomain, whatever it begins with
};

/// Even ones, without gaps; odd ones are left to what the tree of ranks does: between the last tell and glue
/// (tree.hpp), but what goes up before the first take, and what goes down behind every publish, where there
/// are subdomain colours.
struct LoopColours {
  std::vector<std::uint32_t> chunk;    ///< as the subdomain colours that were given
  std::vector<std::uint32_t> publish;  ///< per subdomain of the rank, behind its border
  std::vector<std::uint32_t>
      take;  ///< per subdomain, before its border; means nothing in the first subdomain colour
  std::vector<std::uint32_t> tell;  ///< per subdomain: when it tells the root
  std::uint32_t glue = 0;           ///< behind everything, or before all insides without overlap
  TreeColours tree;                 ///< of what the rank does for the tree of ranks
};
/// `turn_of`: per subdomain of the rank. `tells`: likewise, whether it has a tell; else publish does that.
/// `in_colours`: some subdomain of any rank has a later subdomain colour than the first.
LoopColours loop_colours(std::span<const ChunkOrder> subdomain_colours,
                         std::span<const char> subdomain_colour_of, std::span<const char> tells,
                         bool in_colours, bool overlap, int threads, int rank, const Tree& tree);

}  // namespace talus::graph
