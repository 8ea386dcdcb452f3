#include "partition/migration.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "tests/unit/dense_sample.hpp"

namespace talus {
namespace {

std::size_t at(std::int32_t k) {
  return static_cast<std::size_t>(k);
}

using Sets = std::vector<std::set<std::int32_t>>;

constexpr std::int32_t subdomains = 9;
constexpr std::size_t bodies = 400;

Sets random_sets(std::uint64_t seed) {
  test::Random random(seed);
  Sets sets(bodies);
  for (auto& set : sets)
    for (std::size_t k = random() % 4; k > 0; --k)
      set.insert(static_cast<std::int32_t>(random() % subdomains));
  return sets;
}

BodySubdomains standings_of(const Sets& sets) {
  std::vector<Standing> list;
  for (std::size_t body = 0; body < sets.size(); ++body)
    for (std::int32_t in : sets[body]) list.push_back({static_cast<Slot>(body), in});
  return collect_standings(sets.size(), list);
}

std::vector<BodyId> shuffled_ids() {
  std::vector<BodyId> id;
  for (std::size_t k = 0; k < bodies; ++k) id.push_back(BodyId{static_cast<std::int64_t>(k)});
  test::Random random(9);
  std::shuffle(id.begin(), id.end(), random);
  return id;
}

const std::vector<std::int32_t> ranks{0, 0, 0, 1, 1, 2, 2, 2, 3};

TEST(Migration, MigrantsAreTheBodiesInASubdomainWhereTheyDidNotStand) {
  const Sets before = random_sets(1), now = random_sets(2);
  const Migration plan = plan_migration(standings_of(before), standings_of(now), shuffled_ids(), ranks);
  std::set<std::pair<Slot, std::int32_t>> arrivals, departures, expected_arrivals, expected_departures;
  std::set<Slot> migrants;
  for (std::size_t body = 0; body < bodies; ++body) {
    const auto slot = static_cast<Slot>(body);
    for (std::int32_t in : now[body])
      if (before[body].count(in) == 0) {
        expected_arrivals.emplace(slot, in);
        migrants.insert(slot);
      }
    for (std::int32_t in : before[body])
      if (now[body].count(in) == 0) expected_departures.emplace(slot, in);
  }
  for (const BodyMove& move : plan.arrivals) EXPECT_TRUE(arrivals.emplace(move.body, move.to).second);
  for (const Standing& standing : plan.departures)
    EXPECT_TRUE(departures.emplace(standing.body, standing.subdomain).second);
  EXPECT_EQ(arrivals, expected_arrivals);
  EXPECT_EQ(departures, expected_departures);
  EXPECT_EQ(plan.migrants, static_cast<std::int64_t>(migrants.size()));
}

TEST(Migration, EveryNewCopyHasItsDataAfterOneMessageToEachRankThatLacksThem) {
  const Sets before = random_sets(3), now = random_sets(4);
  const Migration plan = plan_migration(standings_of(before), standings_of(now), shuffled_ids(), ranks);
  std::set<std::pair<Slot, std::int32_t>> holds;  // body, rank
  for (std::size_t body = 0; body < bodies; ++body)
    for (std::int32_t in : before[body]) holds.emplace(static_cast<Slot>(body), ranks[at(in)]);
  std::size_t messages = 0;
  for (const BodyMove& move : plan.arrivals) {
    const auto& old_set = before[at(move.body)];
    if (old_set.empty()) {
      EXPECT_EQ(move.from, -1);
      EXPECT_FALSE(move.travels);
      continue;
    }
    EXPECT_EQ(old_set.count(move.from), 1u);
    if (!move.travels) continue;
    EXPECT_NE(ranks[at(move.from)], ranks[at(move.to)]);
    EXPECT_EQ(move.from, *old_set.begin()) << "the owner sends";
    EXPECT_TRUE(holds.emplace(move.body, ranks[at(move.to)]).second) << "data sent twice";
    ++messages;
  }
  EXPECT_GT(messages, 100u);
  for (std::size_t body = 0; body < bodies; ++body)
    for (std::int32_t in : now[body])
      if (!before[body].empty()) {
        EXPECT_EQ(holds.count({static_cast<Slot>(body), ranks[at(in)]}), 1u);
      }
}

TEST(Migration, ComesInOrderOfSubdomainsAndIdsWhateverTheSlots) {
  const Sets before = random_sets(5), now = random_sets(6);
  const std::vector<BodyId> id = shuffled_ids();
  const Migration plan = plan_migration(standings_of(before), standings_of(now), id, ranks);
  // The same bodies in the slots given by their ids.
  Sets sorted_before(bodies), sorted_now(bodies);
  std::vector<BodyId> sorted_id(bodies);
  for (std::size_t k = 0; k < bodies; ++k) {
    const auto place = static_cast<std::size_t>(id[k]);
    sorted_before[place] = before[k];
    sorted_now[place] = now[k];
    sorted_id[place] = id[k];
  }
  const Migration other =
      plan_migration(standings_of(sorted_before), standings_of(sorted_now), sorted_id, ranks);
  ASSERT_EQ(plan.arrivals.size(), other.arrivals.size());
  for (std::size_t k = 0; k < plan.arrivals.size(); ++k) {
    BodyMove move = plan.arrivals[k];
    move.body = static_cast<Slot>(id[at(move.body)]);
    EXPECT_EQ(move, other.arrivals[k]);
    if (k == 0) continue;
    const BodyMove& last = other.arrivals[k - 1];
    EXPECT_LT(std::tuple(last.from, last.to, last.body), std::tuple(move.from, move.to, move.body));
  }
  ASSERT_EQ(plan.departures.size(), other.departures.size());
  for (std::size_t k = 0; k < plan.departures.size(); ++k)
    EXPECT_EQ(static_cast<Slot>(id[at(plan.departures[k].body)]), other.departures[k].body);
}

TEST(Migration, NothingMovesWhenNothingChanged) {
  const BodySubdomains same = standings_of(random_sets(7));
  const Migration plan = plan_migration(same, same, shuffled_ids(), ranks);
  EXPECT_TRUE(plan.arrivals.empty());
  EXPECT_TRUE(plan.departures.empty());
  EXPECT_EQ(plan.migrants, 0);
}

TEST(Migration, CandidatesMoveWithTheirImpulsesWhereTheirSubdomainChanged) {
  const std::vector<std::int32_t> before{3, 1, 1, 0, 2, 1}, now{3, 0, 2, 0, 1, 0};
  const std::vector<CandidateMove> expected{{1, 1, 0}, {5, 1, 0}, {2, 1, 2}, {4, 2, 1}};
  EXPECT_EQ(plan_candidate_moves(before, now), expected);
}

}  // namespace
}  // namespace talus
