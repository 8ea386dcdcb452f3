/// The tree of ranks over which walls are glued.

#include "runtime/graph/tree.hpp"
#include "runtime/graph/loop_colours.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <span>
#include <stdexcept>
#include <vector>

namespace talus::graph {
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

using enum ChunkOrder::Side;

struct Machine {
  int threads = 1, rank = 0, ranks = 2;
  bool overlap = true;
};
/// Of subdomains with these subdomain colours; in_turns, also elsewhere.
LoopColours colours_of(std::span<const ChunkOrder> subdomain_colours,
                       const std::vector<char>& subdomain_colour_of, const std::vector<char>& tells,
                       bool in_colours, Machine machine = {}) {
  return loop_colours(subdomain_colours, subdomain_colour_of, tells, in_colours, machine.overlap,
                      machine.threads, machine.rank, grow_tree(equal_loads(machine.ranks)));
}

TEST(LoopColours, TakeOneSubdomainAfterAnotherAndGlueAllInTheEnd) {
  const std::vector<ChunkOrder> subdomain_colours = {{border, 0, 0}, {border, 0, 1}, {inside, 0, 2},
                                                     {inside, 0, 2}, {border, 1, 0}, {inside, 1, 2},
                                                     {inside, 1, 3}};
  const LoopColours colours = colours_of(subdomain_colours, {0, 0, 0}, {0, 0, 0}, false);
  EXPECT_EQ(colours.chunk, (std::vector<std::uint32_t>{0, 2, 6, 6, 8, 12, 14}));
  EXPECT_EQ(colours.publish, (std::vector<std::uint32_t>{4, 10, 16}));  // the third has no chunk
  EXPECT_EQ(colours.tell, colours.publish) << "which does that";
  EXPECT_EQ(colours.glue, 18U);
}

TEST(LoopColours, WithoutOverlapGlueBeforeAllInsides) {
  const std::vector<ChunkOrder> subdomain_colours = {
      {border, 0, 0}, {inside, 0, 2}, {border, 1, 0}, {inside, 1, 2}};
  const LoopColours colours = colours_of(subdomain_colours, {0, 0}, {0, 0}, false, {.overlap = false});
  EXPECT_EQ(colours.chunk, (std::vector<std::uint32_t>{0, 10, 4, 12}));
  EXPECT_EQ(colours.publish, (std::vector<std::uint32_t>{2, 6}));
  EXPECT_EQ(colours.glue, 8U);
}

const std::vector<ChunkOrder> at_walls = {{early, 0, 0}, {border, 0, 1}, {inside, 0, 3},
                                          {early, 1, 0}, {inside, 1, 1}, {late, 1, 4}};

TEST(LoopColours, TellFirstAndInLaterTurnsPutTakeAndBorderBehindTheInside) {
  const LoopColours two = colours_of(at_walls, {0, 1}, {1, 1}, true);
  // Early and tell of both; border, publish, inside of the first; inside, take, border, publish of the
  // second.
  EXPECT_EQ(two.chunk, (std::vector<std::uint32_t>{0, 8, 12, 4, 14, 18}));
  EXPECT_EQ(two.publish, (std::vector<std::uint32_t>{10, 20}));
  EXPECT_EQ(two.tell, (std::vector<std::uint32_t>{2, 6}));
  EXPECT_EQ(two.take[1], 16U);
  EXPECT_EQ(two.glue, 22U);
  EXPECT_LT(two.tell[1], two.tree.up);  // what goes up waits for tells only, and nothing that waits for more
  EXPECT_LT(two.tree.up, two.take[1]);  // comes before it
  EXPECT_LT(two.publish[1], two.tree.down);
  // Without overlap nothing is between a publish and who waits for it.
  EXPECT_EQ(colours_of(at_walls, {0, 1}, {1, 1}, true, {.overlap = false}).chunk,
            (std::vector<std::uint32_t>{0, 10, 22, 4, 8, 16}));
}

TEST(LoopColours, OfARankAloneTellWithTheirSubdomain) {
  const LoopColours colours = colours_of(at_walls, {0, 1}, {1, 1}, true, {.ranks = 1});
  EXPECT_EQ(colours.chunk, (std::vector<std::uint32_t>{0, 4, 8, 10, 14, 18}));
  EXPECT_EQ(colours.tell, (std::vector<std::uint32_t>{2, 12}));
}

TEST(LoopColours, OfTheFirstTurnPutNoInsideBeforeAPublishThatOthersWaitFor) {
  const std::vector<ChunkOrder> subdomain_colours = {
      {border, 0, 0}, {inside, 0, 3}, {border, 1, 0}, {inside, 1, 2}};
  const LoopColours colours = colours_of(subdomain_colours, {0, 0}, {0, 0}, true, {.rank = 1});
  EXPECT_EQ(colours.chunk, (std::vector<std::uint32_t>{0, 8, 4, 10}));
  EXPECT_EQ(colours.publish, (std::vector<std::uint32_t>{2, 6}));
}

TEST(LoopColours, OfARelayLetNobodyWaitForEver) {
  // Rank 1 of 40 alike has children, and subdomains of three subdomain colours.
  ASSERT_TRUE(grow_tree(equal_loads(40)).relays(1));
  const std::vector<char> subdomain_colour_of = {1, 2, 0};
  std::vector<ChunkOrder> subdomain_colours;
  for (std::uint32_t e = 0; e < 3; ++e) {
    subdomain_colours.push_back({early, e, 0});
    subdomain_colours.push_back({subdomain_colour_of[e] == 0 ? border : inside, e, 1});
    subdomain_colours.push_back({subdomain_colour_of[e] == 0 ? inside : late, e, 2});
  }
  for (const bool overlap : {true, false})
    for (const int threads : {1, 3}) {
      const LoopColours colours =
          colours_of(subdomain_colours, subdomain_colour_of, {1, 1, 1}, true, {threads, 1, 40, overlap});
      for (const std::size_t e : {0U, 1U, 2U}) EXPECT_LT(colours.tell[e], colours.tree.up);
      for (const std::size_t later : {0U, 1U}) {
        EXPECT_LT(colours.tree.up, colours.take[later]);
        EXPECT_LT(colours.take[later], colours.publish[later]);
        EXPECT_LT(colours.publish[later], colours.tree.down);
      }
      EXPECT_LT(colours.publish[2], colours.take[0]);
      EXPECT_LT(colours.publish[0], colours.take[1]);
      EXPECT_LE(colours.tree.up, colours.tree.down);
      EXPECT_LT(colours.tree.down, colours.glue);
    }
}

TEST(LoopColours, OfSeveralThreadsCountAlikeInAllSubdomains) {
  const std::vector<ChunkOrder> subdomain_colours = {{border, 0, 0}, {border, 0, 1}, {inside, 0, 7},
                                                     {border, 1, 4}, {inside, 1, 9}, {inside, 1, 12}};
  const LoopColours colours = colours_of(subdomain_colours, {0, 0}, {0, 0}, false, {.threads = 2});
  EXPECT_EQ(colours.chunk, (std::vector<std::uint32_t>{0, 2, 6, 0, 6, 8}));
  EXPECT_EQ(colours.publish, (std::vector<std::uint32_t>{4, 4}));
  EXPECT_EQ(colours.glue, 10U);
}

TEST(LoopColours, OfASubdomainAloneFollowFromThoseThatItHadAmongOthers) {
  const std::vector<ChunkOrder> all = {{border, 0, 0}, {inside, 0, 3}, {border, 1, 0}, {border, 1, 2},
                                       {inside, 1, 3}, {inside, 1, 5}, {inside, 2, 3}};
  for (int threads_then : {1, 4})
    for (int threads : {1, 4}) {
      const LoopColours among = colours_of(all, {0, 0, 0}, {0, 0, 0}, false, {.threads = threads_then});
      std::vector<ChunkOrder> alone, again;
      for (std::size_t k = 0; k < all.size(); ++k)
        if (all[k].subdomain == 1) {
          alone.push_back({all[k].side, 0, all[k].colour});
          again.push_back({among.publish[1] < among.chunk[k] ? inside : border, 0, among.chunk[k]});
        }
      const LoopColours here = colours_of(alone, {0}, {0}, false, {.threads = threads}),
                        replayed = colours_of(again, {0}, {0}, false, {.threads = threads});
      EXPECT_EQ(here.chunk, replayed.chunk);
      EXPECT_EQ(here.glue, replayed.glue);
    }
}

}  // namespace
}  // namespace talus::graph
