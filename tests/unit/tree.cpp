/// The tree of ranks over which walls are glued.

#include "runtime/graph/tree.hpp"
#include "runtime/graph/loop_colours.hpp"

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

using graph::ChunkTurn;
using graph::loop_colours;
using enum ChunkTurn::Side;

TEST(LoopColours, TakeOneSubdomainAfterAnotherAndGlueAllInTheEnd) {
  const std::vector<ChunkTurn> turns = {{early, 0, 0}, {early, 0, 1},  {inside, 0, 2}, {inside, 0, 2},
                                        {early, 1, 0}, {inside, 1, 2}, {inside, 1, 3}};
  const graph::LoopColours colours = loop_colours(turns, std::vector<char>(3, 0), false, true, 1, 0, 2);
  EXPECT_EQ(colours.chunk, (std::vector<std::uint32_t>{0, 2, 6, 6, 8, 12, 14}));
  EXPECT_EQ(colours.publish, (std::vector<std::uint32_t>{4, 10, 16}));  // the third has no chunk
  EXPECT_EQ(colours.glue, 18U);
}

TEST(LoopColours, WithoutOverlapGlueBeforeAllInsides) {
  const std::vector<ChunkTurn> turns = {{early, 0, 0}, {inside, 0, 2}, {early, 1, 0}, {inside, 1, 2}};
  const graph::LoopColours colours = loop_colours(turns, std::vector<char>(2, 0), false, false, 1, 0, 2);
  EXPECT_EQ(colours.chunk, (std::vector<std::uint32_t>{0, 10, 4, 12}));
  EXPECT_EQ(colours.publish, (std::vector<std::uint32_t>{2, 6}));
  EXPECT_EQ(colours.glue, 8U);
}

TEST(LoopColours, OfLaterTurnsTellFirstAndPutTakeAndBorderBehindTheInside) {
  const std::vector<ChunkTurn> turns = {
      {early, 0, 0}, {inside, 0, 3}, {early, 1, 0}, {inside, 1, 1}, {late, 1, 4}};
  const std::vector<char> turn_of = {0, 1};
  const graph::LoopColours two = loop_colours(turns, turn_of, true, true, 1, 0, 2);
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
  EXPECT_EQ(loop_colours(turns, turn_of, true, false, 1, 0, 2).chunk,
            (std::vector<std::uint32_t>{6, 18, 0, 4, 12}));
}

TEST(LoopColours, OfTheFirstTurnPutNoInsideBeforeAPublishThatOthersWaitFor) {
  const std::vector<ChunkTurn> turns = {{early, 0, 0}, {inside, 0, 3}, {early, 1, 0}, {inside, 1, 2}};
  const graph::LoopColours colours = loop_colours(turns, std::vector<char>(2, 0), true, true, 1, 1, 2);
  EXPECT_EQ(colours.chunk, (std::vector<std::uint32_t>{0, 8, 4, 10}));
  EXPECT_EQ(colours.publish, (std::vector<std::uint32_t>{2, 6}));
}

TEST(LoopColours, OfARelayLetNobodyWaitForEver) {
  // Rank 1 of 40 has children, and subdomains of three turns.
  std::vector<ChunkTurn> turns;
  for (std::uint32_t e = 0; e < 3; ++e)
    for (const auto side : {early, inside, late})
      if (e > 0 || side != late) turns.push_back({side, e, static_cast<std::uint32_t>(side)});
  const std::vector<char> turn_of = {1, 2, 0};
  turns[0] = {early, 0, 0};
  for (const bool overlap : {true, false})
    for (const int threads : {1, 3}) {
      const graph::LoopColours colours = loop_colours(turns, turn_of, true, overlap, threads, 1, 40);
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
  const graph::LoopColours colours = loop_colours(turns, std::vector<char>(2, 0), false, true, 2, 0, 2);
  EXPECT_EQ(colours.chunk, (std::vector<std::uint32_t>{0, 2, 6, 0, 6, 8}));
  EXPECT_EQ(colours.publish, (std::vector<std::uint32_t>{4, 4}));
  EXPECT_EQ(colours.glue, 10U);
}

TEST(LoopColours, OfASubdomainAloneFollowFromThoseThatItHadAmongOthers) {
  const std::vector<ChunkTurn> all = {{early, 0, 0},  {inside, 0, 3}, {early, 1, 0}, {early, 1, 2},
                                      {inside, 1, 3}, {inside, 1, 5}, {inside, 2, 3}};
  for (int threads_then : {1, 4})
    for (int threads : {1, 4}) {
      const graph::LoopColours among =
          loop_colours(all, std::vector<char>(3, 0), false, true, threads_then, 0, 2);
      std::vector<ChunkTurn> alone, again;
      for (std::size_t k = 0; k < all.size(); ++k)
        if (all[k].subdomain == 1) {
          alone.push_back({all[k].side, 0, all[k].colour});
          again.push_back({among.publish[1] < among.chunk[k] ? inside : early, 0, among.chunk[k]});
        }
      const graph::LoopColours here =
                                   loop_colours(alone, std::vector<char>(1, 0), false, true, threads, 0, 2),
                               replayed =
                                   loop_colours(again, std::vector<char>(1, 0), false, true, threads, 0, 2);
      EXPECT_EQ(here.chunk, replayed.chunk);
      EXPECT_EQ(here.glue, replayed.glue);
    }
}

}  // namespace
}  // namespace talus::graph::tree
