#pragma once

/// A tree of ranks: in every iteration all ranks send data up to one of them, the top, and receive its
/// answer.

#include <cstdint>
#include <span>
#include <vector>

namespace talus::graph {

struct Tree {
  std::vector<int> parent;                 ///< per rank; -1 of the top
  std::vector<std::vector<int>> children;  ///< per rank, in the order in which they are told
  std::vector<int> told;   ///< per rank: when the answer arrives, in units of a sender's cost of a message
  std::vector<int> order;  ///< of all ranks, parents before their children

  int top() const { return order.front(); }
  int last() const { return told[static_cast<std::size_t>(order.back())]; }
  bool leaf(int rank) const { return children[static_cast<std::size_t>(rank)].empty(); }
  /// Has both a parent and children.
  bool relays(int rank) const { return rank != top() && !leaf(rank); }
  /// The ranks below `from`, itself first, then the branch of each child: the order of data in messages
  /// upwards.
  std::vector<int> branch(int from) const;
};

/// What a neighbour costs a rank, in units of work of 6 ns: a message each way, and the processing of what
/// they hold.
inline constexpr std::uint64_t load_of_neighbour = 200;

/// What a rank has to do in an iteration.
struct RankLoad {
  std::uint64_t work = 0;  ///< in units of about 6 ns
  bool waits = false;      ///< messages delay its work: it has groups of a later colour (loop_plan.hpp)
};

/// `load`: of each rank, of at least one. Ranks join the tree in turn: first those that do not wait, and
/// among them the one with the least work first. Each becomes a child of the rank that can reach it soonest,
/// where a message costs its sender 0.3 us and travels 1.5 us (LogP: Culler et al. 1993; Karp et al. 1993,
/// their best broadcast): 96 ranks are told within 8 us, where one rank would spend 29 us on 95 messages. So
/// the ranks that pass messages on are those with the least work.
Tree grow_tree(std::span<const RankLoad> load);

/// Colours of a rank's nodes of the tree, between `tell`, the colour of its last tell, and that of `glue`.
/// Messages upwards are spread over the first half of this range, those of relays near the leaves first, and
/// messages downwards over the second half, so that other work hides both. These colours are odd; all others
/// are even. Only relays use `up`.
struct TreeColours {
  std::uint32_t up = 0, down = 0;
};
TreeColours tree_colours(const Tree& tree, int rank, std::uint32_t tell, std::uint32_t glue);

}  // namespace talus::graph
