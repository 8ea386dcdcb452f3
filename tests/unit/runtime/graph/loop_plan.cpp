/// The colours and the nodes of a rank's loop.

#include "runtime/graph/loop_plan.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>
#include <vector>

namespace talus::graph {
namespace {

std::vector<RankLoad> equal_loads(int ranks) {
  return std::vector<RankLoad>(static_cast<std::size_t>(ranks), RankLoad{5, false});
}

using enum LoopWork::Side;

struct Machine {
  int threads = 1, rank = 0, ranks = 2;
  bool overlap = true;
};
/// Of groups with these colours; in_colours: also elsewhere.
LoopColours colours_of(const std::vector<LoopWork>& work, const std::vector<char>& colours,
                       const std::vector<char>& tells, bool in_colours, Machine machine = {}) {
  LoopSpec spec;
  for (std::size_t e = 0; e < colours.size(); ++e)
    spec.groups.push_back({.colour = colours[e], .tells = tells[e] != 0, .readers = {}});
  spec.work = work;
  spec.in_colours = in_colours;
  spec.overlap = machine.overlap;
  spec.threads = machine.threads;
  spec.rank = machine.rank;
  return loop_colours(spec, grow_tree(equal_loads(machine.ranks)));
}

TEST(LoopColours, TakeOneGroupAfterAnotherAndGlueAllInTheEnd) {
  const std::vector<LoopWork> work = {{border, 0, 0}, {border, 0, 1}, {inside, 0, 2}, {inside, 0, 2},
                                      {border, 1, 0}, {inside, 1, 2}, {inside, 1, 3}};
  const LoopColours colours = colours_of(work, {0, 0, 0}, {0, 0, 0}, false);
  EXPECT_EQ(colours.work, (std::vector<std::uint32_t>{0, 2, 6, 6, 8, 12, 14}));
  EXPECT_EQ(colours.publish, (std::vector<std::uint32_t>{4, 10, 16}));  // the third has no chunk
  EXPECT_EQ(colours.tell, colours.publish) << "which does that";
  EXPECT_EQ(colours.glue, 18U);
}

TEST(LoopColours, WithoutOverlapGlueBeforeAllInsides) {
  const std::vector<LoopWork> work = {{border, 0, 0}, {inside, 0, 2}, {border, 1, 0}, {inside, 1, 2}};
  const LoopColours colours = colours_of(work, {0, 0}, {0, 0}, false, {.overlap = false});
  EXPECT_EQ(colours.work, (std::vector<std::uint32_t>{0, 10, 4, 12}));
  EXPECT_EQ(colours.publish, (std::vector<std::uint32_t>{2, 6}));
  EXPECT_EQ(colours.glue, 8U);
}

const std::vector<LoopWork> at_walls = {{early, 0, 0}, {border, 0, 1}, {inside, 0, 3},
                                        {early, 1, 0}, {inside, 1, 1}, {late, 1, 4}};

TEST(LoopColours, TellFirstAndInLaterGroupColoursPutTakeAndBorderBehindTheInside) {
  const LoopColours two = colours_of(at_walls, {0, 1}, {1, 1}, true);
  // Early and tell of both; border, publish, inside of the first; inside, take, border, publish of the
  // second.
  EXPECT_EQ(two.work, (std::vector<std::uint32_t>{0, 8, 12, 4, 14, 18}));
  EXPECT_EQ(two.publish, (std::vector<std::uint32_t>{10, 20}));
  EXPECT_EQ(two.tell, (std::vector<std::uint32_t>{2, 6}));
  EXPECT_EQ(two.take[1], 16U);
  EXPECT_EQ(two.glue, 22U);
  EXPECT_LT(two.tell[1], two.tree.up);  // what goes up waits for tells only, and nothing that waits for more
  EXPECT_LT(two.tree.up, two.take[1]);  // comes before it
  EXPECT_LT(two.publish[1], two.tree.down);
  // Without overlap nothing is between a publish and who waits for it.
  EXPECT_EQ(colours_of(at_walls, {0, 1}, {1, 1}, true, {.overlap = false}).work,
            (std::vector<std::uint32_t>{0, 10, 22, 4, 8, 16}));
}

TEST(LoopColours, OfARankAloneTellWithTheirGroup) {
  const LoopColours colours = colours_of(at_walls, {0, 1}, {1, 1}, true, {.ranks = 1});
  EXPECT_EQ(colours.work, (std::vector<std::uint32_t>{0, 4, 8, 10, 14, 18}));
  EXPECT_EQ(colours.tell, (std::vector<std::uint32_t>{2, 12}));
}

TEST(LoopColours, OfTheFirstGroupColourPutNoInsideBeforeAPublishThatOthersWaitFor) {
  const std::vector<LoopWork> work = {{border, 0, 0}, {inside, 0, 3}, {border, 1, 0}, {inside, 1, 2}};
  const LoopColours colours = colours_of(work, {0, 0}, {0, 0}, true, {.rank = 1});
  EXPECT_EQ(colours.work, (std::vector<std::uint32_t>{0, 8, 4, 10}));
  EXPECT_EQ(colours.publish, (std::vector<std::uint32_t>{2, 6}));
}

TEST(LoopColours, OfARelayLetNobodyWaitForEver) {
  // Rank 1 of 40 alike has children, and groups of three colours.
  ASSERT_TRUE(grow_tree(equal_loads(40)).relays(1));
  const std::vector<char> colour_of = {1, 2, 0};
  std::vector<LoopWork> work;
  for (std::uint32_t e = 0; e < 3; ++e) {
    work.push_back({early, e, 0});
    work.push_back({colour_of[e] == 0 ? border : inside, e, 1});
    work.push_back({colour_of[e] == 0 ? inside : late, e, 2});
  }
  for (const bool overlap : {true, false})
    for (const int threads : {1, 3}) {
      const LoopColours colours = colours_of(work, colour_of, {1, 1, 1}, true, {threads, 1, 40, overlap});
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

TEST(LoopColours, OfSeveralThreadsCountAlikeInAllGroups) {
  const std::vector<LoopWork> work = {{border, 0, 0}, {border, 0, 1}, {inside, 0, 7},
                                      {border, 1, 4}, {inside, 1, 9}, {inside, 1, 12}};
  const LoopColours colours = colours_of(work, {0, 0}, {0, 0}, false, {.threads = 2});
  EXPECT_EQ(colours.work, (std::vector<std::uint32_t>{0, 2, 6, 0, 6, 8}));
  EXPECT_EQ(colours.publish, (std::vector<std::uint32_t>{4, 4}));
  EXPECT_EQ(colours.glue, 10U);
}

TEST(LoopColours, OfAGroupAloneFollowFromThoseThatItHadAmongOthers) {
  const std::vector<LoopWork> all = {{border, 0, 0}, {inside, 0, 3}, {border, 1, 0}, {border, 1, 2},
                                     {inside, 1, 3}, {inside, 1, 5}, {inside, 2, 3}};
  for (int threads_then : {1, 4})
    for (int threads : {1, 4}) {
      const LoopColours among = colours_of(all, {0, 0, 0}, {0, 0, 0}, false, {.threads = threads_then});
      std::vector<LoopWork> alone, again;
      for (std::size_t k = 0; k < all.size(); ++k)
        if (all[k].group == 1) {
          alone.push_back({all[k].side, 0, all[k].colour});
          again.push_back({among.publish[1] < among.work[k] ? inside : border, 0, among.work[k]});
        }
      const LoopColours here = colours_of(alone, {0}, {0}, false, {.threads = threads}),
                        replayed = colours_of(again, {0}, {0}, false, {.threads = threads});
      EXPECT_EQ(here.work, replayed.work);
      EXPECT_EQ(here.glue, replayed.glue);
    }
}

/// Two groups, the second of a later colour, with a tell each; three nodes of work in the first, two in the
/// second, of which one conflicts with the one before it.
LoopSpec two_groups() {
  LoopSpec spec;
  spec.groups = {{.colour = 0, .tells = true, .readers = {1}}, {.colour = 1, .tells = true, .readers = {0}}};
  spec.work = {{early, 0, 0, 5, 0},
               {border, 0, 1, 5, 1},
               {inside, 0, 2, 5, 2},
               {inside, 1, 0, 5, 3},
               {late, 1, 1, 5, 4}};
  spec.offset = {0, 0, 0, 0, 1, 2};
  spec.neighbour = {4, 3};
  spec.in_colours = true;
  return spec;
}

std::vector<std::uint32_t> neighbours(const LoopPlan& plan, std::size_t node) {
  std::vector<std::uint32_t> found(plan.neighbour.begin() + plan.offset[node],
                                   plan.neighbour.begin() + plan.offset[node + 1]);
  std::ranges::sort(found);
  return found;
}

TEST(LoopPlan, NumbersWorkPublishesTheRootGluesTakesAndTells) {
  using enum LoopRole;
  const LoopPlan plan = plan_loop(two_groups(), grow_tree(equal_loads(1)));
  const std::vector<std::pair<LoopRole, std::uint32_t>> expected = {
      {work, 0}, {work, 0},    {work, 0},    {work, 1},
      {work, 1}, {publish, 0}, {publish, 1}, {LoopRole::root, LoopPlan::none},
      {glue, 0}, {glue, 1},    {take, 1},    {tell, 0},
      {tell, 1}};
  ASSERT_EQ(plan.nodes.size(), expected.size());
  for (std::size_t n = 0; n < expected.size(); ++n) {
    EXPECT_EQ(plan.nodes[n].role, expected[n].first) << n;
    EXPECT_EQ(plan.nodes[n].group, expected[n].second) << n;
  }
}

TEST(LoopPlan, ConflictsAreWhatSharesData) {
  const LoopPlan plan = plan_loop(two_groups(), grow_tree(equal_loads(1)));
  using Nodes = std::vector<std::uint32_t>;
  EXPECT_EQ(neighbours(plan, 0), (Nodes{5, 8, 11})) << "early: its publish, glue and tell";
  EXPECT_EQ(neighbours(plan, 1), (Nodes{5, 8})) << "border: its publish and glue";
  EXPECT_EQ(neighbours(plan, 2), (Nodes{})) << "inside: none";
  EXPECT_EQ(neighbours(plan, 4), (Nodes{3, 6, 9, 10})) << "late: the work beside it, publish, glue and take";
  EXPECT_EQ(neighbours(plan, 10), (Nodes{4, 5, 6, 9})) << "take reads what the earlier colour publishes";
  EXPECT_EQ(neighbours(plan, 7), (Nodes{8, 9, 11, 12})) << "the root: tells and glues";
}

TEST(LoopPlan, WithoutExchangeThereIsWorkOnly) {
  LoopSpec spec = two_groups();
  for (LoopGroup& group : spec.groups) group.exchanges = false;
  EXPECT_EQ(plan_loop(spec, grow_tree(equal_loads(1))).nodes.size(), spec.work.size());
}

TEST(LoopPlan, TheExchangeOfAGroupIsWithTheThreadOfItsFirstWorkUnlessOthersMustNot) {
  LoopSpec spec = two_groups();
  spec.threads = 2;
  const LoopPlan plan = plan_loop(spec, grow_tree(equal_loads(1)));
  for (std::size_t n = spec.work.size(); n < plan.nodes.size(); ++n)
    EXPECT_EQ(plan.owner[n], plan.nodes[n].group == 1 ? plan.owner[3] : 0) << n;
  EXPECT_EQ(plan.owner[3], 1u);
  spec.only_first_thread_exchanges = true;
  const LoopPlan first = plan_loop(spec, grow_tree(equal_loads(1)));
  for (std::size_t n = spec.work.size(); n < first.nodes.size(); ++n) EXPECT_EQ(first.owner[n], 0u) << n;
}

}  // namespace
}  // namespace talus::graph
