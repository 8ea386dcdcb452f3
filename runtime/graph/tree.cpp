#include "runtime/graph/tree.hpp"

#include <algorithm>
#include <functional>
#include <numeric>
#include <queue>
#include <stdexcept>
#include <utility>

namespace talus::graph {

namespace {

/// Time from the start of a message until its receiver can forward it, in units of what a message costs its
/// sender (0.3 us).
constexpr int under_way = 7;
/// Eight messages to children and eight back: the ranks with the least work have time for no more.
constexpr std::size_t most_children = 8;

}  // namespace

Tree grow_tree(std::span<const RankLoad> load) {
  if (load.empty()) throw std::invalid_argument("a tree of no ranks");
  const std::size_t ranks = load.size();
  Tree tree{std::vector<int>(ranks, -1), std::vector<std::vector<int>>(ranks), std::vector<int>(ranks, 0),
            std::vector<int>(ranks)};
  std::iota(tree.order.begin(), tree.order.end(), 0);
  std::ranges::stable_sort(tree.order, {}, [&](int rank) {
    const RankLoad& own = load[static_cast<std::size_t>(rank)];
    return std::pair(own.waits, own.work);
  });
  /// When a rank can begin its next message, and its place in the order.
  using Next = std::pair<int, std::size_t>;
  std::priority_queue<Next, std::vector<Next>, std::greater<>> next;
  next.push({0, 0});
  for (std::size_t k = 1; k < ranks; ++k) {
    const auto [free, place] = next.top();
    next.pop();
    const auto above = static_cast<std::size_t>(tree.order[place]),
               own = static_cast<std::size_t>(tree.order[k]);
    tree.parent[own] = static_cast<int>(above);
    tree.children[above].push_back(static_cast<int>(own));
    tree.told[own] = free + under_way;
    if (tree.children[above].size() < most_children) next.push({free + 1, place});
    next.push({free + under_way, k});
  }
  return tree;
}

std::vector<int> Tree::branch(int from) const {
  std::vector<int> ranks = {from};
  for (const int child : children[static_cast<std::size_t>(from)]) {
    const std::vector<int> below = branch(child);
    ranks.insert(ranks.end(), below.begin(), below.end());
  }
  return ranks;
}

TreeColours tree_colours(const Tree& tree, int rank, std::uint32_t tell, std::uint32_t glue) {
  const std::uint32_t inner = (glue - tell) / 2 - 1;
  const int whole = std::max(1, tree.last()), at = tree.told[static_cast<std::size_t>(rank)];
  const auto colour = [&](int part) {
    return std::min(
        tell +
            2 * static_cast<std::uint32_t>(std::uint64_t{inner} * static_cast<std::uint64_t>(part) /
                                           (2 * static_cast<std::uint64_t>(whole))) +
            3,
        glue - 1);
  };
  const bool last = rank != tree.top() && tree.leaf(rank);
  return {colour(whole - at), last ? glue - 1 : colour(whole + at)};
}

}  // namespace talus::graph
