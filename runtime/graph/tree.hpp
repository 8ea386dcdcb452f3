#pragma once

/// Ranks as a tree, for what all tell one of them, the top, in every iteration and hear back from it.

#include <cstdint>
#include <span>
#include <vector>

namespace talus::graph {

struct Tree {
  std::vector<int> parent;                 ///< per rank; -1 of the top
  std::vector<std::vector<int>> children;  ///< per rank, in the order in which they are told
  std::vector<int> told;   ///< per rank: when what goes down reaches it, in costs of a message
  std::vector<int> order;  ///< of all ranks, parents before their children

  int top() const { return order.front(); }
  int last() const { return told[static_cast<std::size_t>(order.back())]; }
  bool leaf(int rank) const { return children[static_cast<std::size_t>(rank)].empty(); }
  /// Has both a parent and children.
  bool relays(int rank) const { return rank != top() && !leaf(rank); }
  /// The ranks that hang on `from`, itself first, then the branch of each child: the order of what goes up.
  std::vector<int> branch(int from) const;
};

/// What a neighbour costs a rank, in units of work of 6 ns: a message there and one back, and what is done
/// with what they hold.
inline constexpr std::uint64_t load_of_neighbour = 200;

/// What a rank has to do in an iteration.
struct RankLoad {
  std::uint64_t work = 0;  ///< in units of about 6 ns
  bool waits = false;      ///< on the way for others: it has groups of a later colour (loop_plan.hpp)
};

/// `load`: of each rank, of at least one. Each rank in turn, first those that do not wait, of
/// them the one with the least work first, hangs on the one that can tell it soonest, where a message costs a
/// rank 0.3 us and takes 1.5 us (LogP: Culler et al. 1993; Karp et al. 1993, their best broadcast): 96 ranks
/// are told within 8 us, where one rank would spend 29 us on 95 messages. So those that hand on are those
/// that have time for it.
Tree grow_tree(std::span<const RankLoad> load);

/// Colours of a rank's two parts in the loop, between those of its last tell and of glue: the way up is
/// spread over the first half of what comes between (relays near the leaves first), the way down over the
/// second, so that both are hidden. Other nodes have even colours, these odd ones. `up` is of relays.
struct TreeColours {
  std::uint32_t up = 0, down = 0;
};
TreeColours tree_colours(const Tree& tree, int rank, std::uint32_t tell, std::uint32_t glue);

}  // namespace talus::graph
