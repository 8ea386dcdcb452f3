/// The tree of ranks over which walls are glued.

#include "runtime/graph/tree.hpp"
#include "runtime/graph/loop_colours.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <stdexcept>
#include <vector>

namespace talus::graph {
namespace {

std::vector<std::uint64_t> equal_loads(int ranks) {
  return std::vector<std::uint64_t>(static_cast<std::size_t>(ranks), 5);
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

TEST(Tree, IsHandedOnByTheRanksWithTheLeastWork) {
  std::vector<std::uint64_t> load;
  for (std::uint64_t rank = 0; rank < 96; ++rank) load.push_back(1000 + rank * 37 % 96);
  const Tree tree = grow_tree(load);
  std::uint64_t most = 0, least = 2000;
  for (int rank = 0; rank < 96; ++rank) {
    const std::uint64_t own = load[static_cast<std::size_t>(rank)];
    if (tree.leaf(rank))
      least = std::min(least, own);
    else
      most = std::max(most, own);
  }
  EXPECT_EQ(load[static_cast<std::size_t>(tree.top())], 1000U);
  EXPECT_LT(most, least);
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

using enum ChunkTurn::Side;

TEST(LoopColours, TakeOneSubdomainAfterAnotherAndGlueAllInTheEnd) {
  const std::vector<ChunkTurn> turns = {{early, 0, 0}, {early, 0, 1},  {inside, 0, 2}, {inside, 0, 2},
                                        {early, 1, 0}, {inside, 1, 2}, {inside, 1, 3}};
  const LoopColours colours =
      loop_colours(turns, std::vector<char>(3, 0), false, true, 1, 0, grow_tree(equal_loads(2)));
  EXPECT_EQ(colours.chunk, (std::vector<std::uint32_t>{0, 2, 6, 6, 8, 12, 14}));
  EXPECT_EQ(colours.publish, (std::vector<std::uint32_t>{4, 10, 16}));  // the third has no chunk
  EXPECT_EQ(colours.glue, 18U);
}

TEST(LoopColours, WithoutOverlapGlueBeforeAllInsides) {
  const std::vector<ChunkTurn> turns = {{early, 0, 0}, {inside, 0, 2}, {early, 1, 0}, {inside, 1, 2}};
  const LoopColours colours =
      loop_colours(turns, std::vector<char>(2, 0), false, false, 1, 0, grow_tree(equal_loads(2)));
  EXPECT_EQ(colours.chunk, (std::vector<std::uint32_t>{0, 10, 4, 12}));
  EXPECT_EQ(colours.publish, (std::vector<std::uint32_t>{2, 6}));
  EXPECT_EQ(colours.glue, 8U);
}

TEST(LoopColours, OfLaterTurnsTellFirstAndPutTakeAndBorderBehindTheInside) {
  const std::vector<ChunkTurn> turns = {
      {early, 0, 0}, {inside, 0, 3}, {early, 1, 0}, {inside, 1, 1}, {late, 1, 4}};
  const std::vector<char> turn_of = {0, 1};
  const LoopColours two = loop_colours(turns, turn_of, true, true, 1, 0, grow_tree(equal_loads(2)));
  // Border, publish and inside of the first; early, tell, inside, take, border, publish of the second.
  EXPECT_EQ(two.chunk, (std::vector<std::uint32_t>{0, 4, 6, 10, 14}));
  EXPECT_EQ(two.publish, (std::vector<std::uint32_t>{2, 16}));
  EXPECT_EQ(two.tell, (std::vector<std::uint32_t>{2, 8}));
  EXPECT_EQ(two.take[1], 12U);
  EXPECT_EQ(two.glue, 18U);
  EXPECT_LT(two.tell[1], two.tree.up);  // what goes up waits for tells only, and nothing that waits for more
  EXPECT_LT(two.tree.up, two.take[1]);  // comes before it
  EXPECT_LT(two.publish[1], two.tree.down);
  // Without overlap nothing is between a publish and who waits for it.
  EXPECT_EQ(loop_colours(turns, turn_of, true, false, 1, 0, grow_tree(equal_loads(2))).chunk,
            (std::vector<std::uint32_t>{6, 18, 0, 4, 12}));
}

TEST(LoopColours, OfTheFirstTurnPutNoInsideBeforeAPublishThatOthersWaitFor) {
  const std::vector<ChunkTurn> turns = {{early, 0, 0}, {inside, 0, 3}, {early, 1, 0}, {inside, 1, 2}};
  const LoopColours colours =
      loop_colours(turns, std::vector<char>(2, 0), true, true, 1, 1, grow_tree(equal_loads(2)));
  EXPECT_EQ(colours.chunk, (std::vector<std::uint32_t>{0, 8, 4, 10}));
  EXPECT_EQ(colours.publish, (std::vector<std::uint32_t>{2, 6}));
}

TEST(LoopColours, OfARelayLetNobodyWaitForEver) {
  // Rank 1 of 40 alike has children, and subdomains of three turns.
  const Tree tree = grow_tree(equal_loads(40));
  ASSERT_TRUE(tree.relays(1));
  std::vector<ChunkTurn> turns;
  for (std::uint32_t e = 0; e < 3; ++e)
    for (const auto side : {early, inside, late})
      if (e > 0 || side != late) turns.push_back({side, e, static_cast<std::uint32_t>(side)});
  const std::vector<char> turn_of = {1, 2, 0};
  turns[0] = {early, 0, 0};
  for (const bool overlap : {true, false})
    for (const int threads : {1, 3}) {
      const LoopColours colours = loop_colours(turns, turn_of, true, overlap, threads, 1, tree);
      for (const std::size_t later : {0U, 1U}) {
        EXPECT_LT(colours.tell[later], colours.tree.up);
        EXPECT_LT(colours.tree.up, colours.take[later]);
        EXPECT_LT(colours.take[later], colours.publish[later]);
        EXPECT_LT(colours.publish[later], colours.tree.down);
      }
      EXPECT_LT(colours.publish[2], colours.take[0]);
      EXPECT_LT(colours.publish[0], colours.take[1]);
      EXPECT_LT(colours.tree.down, colours.glue);
    }
}

TEST(LoopColours, OfSeveralThreadsCountAlikeInAllSubdomains) {
  const std::vector<ChunkTurn> turns = {{early, 0, 0}, {early, 0, 1},  {inside, 0, 7},
                                        {early, 1, 4}, {inside, 1, 9}, {inside, 1, 12}};
  const LoopColours colours =
      loop_colours(turns, std::vector<char>(2, 0), false, true, 2, 0, grow_tree(equal_loads(2)));
  EXPECT_EQ(colours.chunk, (std::vector<std::uint32_t>{0, 2, 6, 0, 6, 8}));
  EXPECT_EQ(colours.publish, (std::vector<std::uint32_t>{4, 4}));
  EXPECT_EQ(colours.glue, 10U);
}

TEST(LoopColours, OfASubdomainAloneFollowFromThoseThatItHadAmongOthers) {
  const std::vector<ChunkTurn> all = {{early, 0, 0},  {inside, 0, 3}, {early, 1, 0}, {early, 1, 2},
                                      {inside, 1, 3}, {inside, 1, 5}, {inside, 2, 3}};
  const Tree two = grow_tree(equal_loads(2));
  for (int threads_then : {1, 4})
    for (int threads : {1, 4}) {
      const LoopColours among = loop_colours(all, std::vector<char>(3, 0), false, true, threads_then, 0, two);
      std::vector<ChunkTurn> alone, again;
      for (std::size_t k = 0; k < all.size(); ++k)
        if (all[k].subdomain == 1) {
          alone.push_back({all[k].side, 0, all[k].colour});
          again.push_back({among.publish[1] < among.chunk[k] ? inside : early, 0, among.chunk[k]});
        }
      const LoopColours here = loop_colours(alone, std::vector<char>(1, 0), false, true, threads, 0, two),
                        replayed = loop_colours(again, std::vector<char>(1, 0), false, true, threads, 0, two);
      EXPECT_EQ(here.chunk, replayed.chunk);
      EXPECT_EQ(here.glue, replayed.glue);
    }
}

}  // namespace
}  // namespace talus::graph
