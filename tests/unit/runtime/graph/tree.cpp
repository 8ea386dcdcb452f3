/// The tree of ranks over which walls are glued.

#include "runtime/graph/tree.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <span>
#include <stdexcept>
#include <vector>

namespace talus::graph::tree_test {
namespace {

std::vector<RankLoad> equal_loads(int ranks) {
  return std::vector<RankLoad>(static_cast<std::size_t>(ranks), RankLoad{5, false});
}

TEST(Tree, BringsEveryRankToTheTopOnce) {
  for (int ranks : {1, 2, 7, 8, 43, 44, 96, 300}) {
    const Tree tree = grow_tree(equal_loads(ranks));
    std::set<int> met = {tree.top()};
    for (const int rank : tree.order) {
      EXPECT_TRUE(met.count(rank)) << "a parent comes first";
      for (const int child : tree.children[static_cast<std::size_t>(rank)]) {
        EXPECT_EQ(tree.parent[static_cast<std::size_t>(child)], rank);
        EXPECT_TRUE(met.insert(child).second) << child << " of " << ranks;
      }
    }
    EXPECT_EQ(met.size(), static_cast<std::size_t>(ranks));
    EXPECT_EQ(tree.parent[static_cast<std::size_t>(tree.top())], -1);
  }
}

TEST(Tree, IsHandedOnByTheRanksWithTheLeastWorkOfThoseThatDoNotWait) {
  std::vector<RankLoad> load;
  for (std::uint64_t rank = 0; rank < 96; ++rank) load.push_back({1000 + rank * 37 % 96, rank % 2 == 0});
  const Tree tree = grow_tree(load);
  std::uint64_t most = 0, least = 2000;
  for (int rank = 0; rank < 96; ++rank) {
    const RankLoad& own = load[static_cast<std::size_t>(rank)];
    if (!tree.leaf(rank)) {
      EXPECT_FALSE(own.waits) << rank;
      most = std::max(most, own.work);
    } else if (!own.waits) {
      least = std::min(least, own.work);
    }
  }
  EXPECT_LT(most, least);
}

TEST(Tree, NamesTheRanksOfABranchParentsFirstAndChildByChild) {
  const Tree tree = grow_tree(equal_loads(96));
  EXPECT_EQ(tree.branch(tree.top()).size(), 96U);
  for (int rank = 0; rank < 96; ++rank) {
    std::vector<int> expected = {rank};
    for (const int child : tree.children[static_cast<std::size_t>(rank)])
      for (const int below : tree.branch(child)) expected.push_back(below);
    EXPECT_EQ(tree.branch(rank), expected);
  }
}

// Six children a rank would take 36 messages' time to the last of 96 ranks, one rank alone 101.
TEST(Tree, ReachesItsLastRankSoon) {
  const Tree tree = grow_tree(equal_loads(96));
  EXPECT_LE(tree.last(), 26);
  for (const auto& children : tree.children) EXPECT_LE(children.size(), 8U);
}

TEST(Tree, OfNoRanksIsRefused) {
  EXPECT_THROW(grow_tree({}), std::invalid_argument);
}

// A relay that took the answer before it had sent its own part up would wait for ever.
TEST(Tree, HandsUpBeforeItHandsDown) {
  for (int ranks : {1, 2, 8, 50, 96, 1000}) {
    const Tree tree = grow_tree(equal_loads(ranks));
    for (std::uint32_t inner : {0u, 1u, 2u, 5u, 40u}) {
      const std::uint32_t publish = 12, glue = publish + 2 * inner + 2;
      for (int rank = 0; rank < ranks; ++rank) {
        const TreeColours own = tree_colours(tree, rank, publish, glue);
        EXPECT_GT(own.up, publish);
        EXPECT_LE(own.up, own.down);
        EXPECT_LT(own.down, glue);
        EXPECT_EQ(own.up % 2, 1u);
        EXPECT_EQ(own.down % 2, 1u);
        if (rank == tree.top()) continue;
        const int parent = tree.parent[static_cast<std::size_t>(rank)];
        const TreeColours above = tree_colours(tree, parent, publish, glue);
        EXPECT_LE(above.down, own.down) << rank << " of " << ranks;
        if (!tree.relays(rank)) continue;
        EXPECT_LE(own.up, parent == tree.top() ? above.down : above.up) << rank << " of " << ranks;
      }
    }
  }
}

}  // namespace
}  // namespace talus::graph::tree_test
