/// The tree of ranks over which walls are glued.

#include "runtime/graph/tree.hpp"

#include <gtest/gtest.h>

#include <set>

namespace talus::graph::tree {
namespace {

TEST(Tree, BringsEveryRankToRankZeroOnce) {
  for (int ranks : {1, 2, 7, 8, 43, 44, 96, 300}) {
    std::set<int> met = {0};
    for (int rank = 0; rank < ranks; ++rank)
      for (int child = first_child(rank); child < end_of_children(rank, ranks); ++child) {
        EXPECT_EQ(parent(child), rank);
        EXPECT_EQ(branch(child, rank), child);
        EXPECT_EQ(depth(child), depth(rank) + 1);
        EXPECT_TRUE(met.insert(child).second) << child << " of " << ranks;
      }
    EXPECT_EQ(met.size(), static_cast<std::size_t>(ranks));
  }
}

TEST(Tree, KnowsWhichChildABranchHangsOn) {
  constexpr int ranks = 300;
  for (int rank = 1; rank < ranks; ++rank) {
    int top = rank;
    for (; parent(top) != 0; top = parent(top)) EXPECT_EQ(branch(rank, parent(top)), top);
    EXPECT_EQ(branch(rank, 0), top);
  }
  EXPECT_EQ(branch(3, 3), -1);
  EXPECT_EQ(branch(0, 3), -1);
  EXPECT_EQ(branch(4, 3), -1);  // a sister
  EXPECT_EQ(branch(first_child(4), 3), -1);
}

// A relay that took the answer before it had sent its own part up would wait for ever.
TEST(Tree, HandsUpBeforeItHandsDown) {
  for (int ranks : {1, 2, 8, 50, 96, 1000})
    for (std::uint32_t inner : {0u, 1u, 2u, 5u, 40u}) {
      const std::uint32_t publish = 12, glue = publish + 2 * inner + 2;
      for (int rank = 0; rank < ranks; ++rank) {
        const Colours own = colours(rank, ranks, publish, glue);
        EXPECT_GT(own.up, publish);
        EXPECT_LE(own.up, own.down);
        EXPECT_LT(own.down, glue);
        EXPECT_EQ(own.up % 2, 1u);
        EXPECT_EQ(own.down % 2, 1u);
        if (rank == 0) continue;
        const Colours above = colours(parent(rank), ranks, publish, glue);
        EXPECT_LE(above.down, own.down) << rank << " of " << ranks;
        if (!relays(rank, ranks)) continue;
        EXPECT_LE(own.up, parent(rank) == 0 ? above.down : above.up) << rank << " of " << ranks;
      }
    }
}

}  // namespace
}  // namespace talus::graph::tree
