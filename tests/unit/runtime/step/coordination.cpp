#include <gtest/gtest.h>

#include <random>
#include <utility>
#include <vector>

#include "runtime/graph/one_rank.hpp"
#include "runtime/step/coordination.hpp"
#include "runtime/step/step_report.hpp"

namespace talus::coordination_test {
namespace {

/// Frictionless contacts that all carry, between grains, and of grains at one wall.
StepState state_of(std::size_t grains, const std::vector<std::pair<Slot, Slot>>& pairs,
                   const std::vector<Slot>& at_wall) {
  StepState state;
  for (std::size_t k = 0; k < grains; ++k)
    add_sphere(state.bodies, BodyId{static_cast<std::int64_t>(k)}, Vec3::Zero(), 1, 1);
  Contacts& contacts = state.contacts;
  for (const auto& [first, second] : pairs) {
    contacts.first.push_back(first);
    contacts.second.push_back(second);
  }
  for (const Slot body : at_wall) {
    contacts.first.push_back(body);
    contacts.second.push_back(-1);
  }
  contacts.nx.assign(contacts.first.size(), 1);
  contacts.ny.assign(contacts.first.size(), 0);
  contacts.nz.assign(contacts.first.size(), 0);
  contacts.rn.assign(contacts.first.size(), 1);
  const auto of_grains = static_cast<std::int32_t>(pairs.size()),
             all = static_cast<std::int32_t>(contacts.first.size());
  state.chunks.begin = {0, of_grains, all};
  state.chunks.wall = {-1, 0};
  state.chunks.colour = {0, 1};
  contacts.count = {of_grains, all - of_grains};
  return state;
}

/// Five grains that all touch one another, and each the wall.
const std::vector<std::pair<Slot, Slot>> cluster = {{0, 1}, {0, 2}, {0, 3}, {0, 4}, {1, 2},
                                                    {1, 3}, {1, 4}, {2, 3}, {2, 4}, {3, 4}};

TEST(Coordination, CountsAContactForBothGrainsAndOnceAtAWall) {
  EXPECT_EQ(coordination(state_of(5, cluster, {}), graph::one_rank(), 4), 4);
  EXPECT_EQ(coordination(state_of(5, cluster, {0, 1, 2, 3, 4}), graph::one_rank(), 4), 5);
}

// 6 hangs on 5, which leans on 0, 1 and 2: without 6 three contacts do not hold 5, so neither counts, and
// nothing of theirs does for 0, 1 and 2.
TEST(Coordination, LeavesOutRattlersWithAllTheirContacts) {
  std::vector<std::pair<Slot, Slot>> pairs = cluster;
  for (const auto& pair : {std::pair<Slot, Slot>{5, 0}, {5, 1}, {5, 2}, {6, 5}}) pairs.push_back(pair);
  EXPECT_EQ(coordination(state_of(7, pairs, {}), graph::one_rank(), 4), 4);
  EXPECT_DOUBLE_EQ(coordination(state_of(7, pairs, {}), graph::one_rank(), 3), 26.0 / 6);
  EXPECT_EQ(coordination(state_of(7, {{5, 6}}, {5}), graph::one_rank(), 2), 0);
}

/// The definition, word by word: grains with fewer than `hold` contacts go, again and again, with theirs.
double by_definition(std::size_t grains, std::vector<std::pair<Slot, Slot>> pairs, std::vector<Slot> at_wall,
                     int hold) {
  std::vector<char> gone(grains, 0);
  for (;;) {
    std::vector<int> count(grains, 0);
    for (const auto& [a, b] : pairs)
      ++count[static_cast<std::size_t>(a)], ++count[static_cast<std::size_t>(b)];
    for (const Slot a : at_wall) ++count[static_cast<std::size_t>(a)];
    int left = 0, sum = 0;
    bool again = false;
    for (std::size_t k = 0; k < grains; ++k) {
      if (gone[k] != 0) continue;
      if (count[k] < hold)
        gone[k] = 1, again = true;
      else
        ++left, sum += count[k];
    }
    if (!again) return left > 0 ? static_cast<double>(sum) / left : 0;
    const auto lost = [&](Slot s) { return gone[static_cast<std::size_t>(s)] != 0; };
    std::erase_if(pairs, [&](const auto& pair) { return lost(pair.first) || lost(pair.second); });
    std::erase_if(at_wall, lost);
  }
}

TEST(Coordination, IsThatOfItsDefinitionInRandomNetworks) {
  std::mt19937 random(5);
  constexpr std::size_t grains = 40;
  std::uniform_int_distribution<Slot> any(0, grains - 1);
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<std::pair<Slot, Slot>> pairs;
    std::vector<Slot> at_wall;
    for (int k = 0; k < 40 + trial / 3; ++k)
      if (const Slot a = any(random), b = any(random); a != b) pairs.push_back({a, b});
    for (int k = 0; k < trial % 7; ++k) at_wall.push_back(any(random));
    for (int hold = 2; hold <= 4; ++hold)
      EXPECT_EQ(coordination(state_of(grains, pairs, at_wall), graph::one_rank(), hold),
                by_definition(grains, pairs, at_wall, hold))
          << trial << ' ' << hold;
  }
}

/// Every other grain stands in both of two subdomains, and either copy has a part of its contacts.
TEST(Coordination, IsThatOfAllCopiesTogether) {
  std::mt19937 random(6);
  constexpr Slot grains = 40;
  std::uniform_int_distribution<Slot> any(0, grains - 1);
  std::bernoulli_distribution coin;
  // Of an even grain slots k and grains + k; odd ones stand in one subdomain only.
  const auto shared = [](Slot k) { return k % 2 == 0; };
  const auto home = [](Slot k) { return k % 4 == 1 ? 0 : 1; };
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<std::pair<Slot, Slot>> pairs, of_slots;
    for (int k = 0; k < 60 + trial / 2; ++k) {
      const Slot a = any(random), b = any(random);
      if (a == b || (!shared(a) && !shared(b) && home(a) != home(b))) continue;
      const int in = !shared(a) ? home(a) : !shared(b) ? home(b) : coin(random) ? 1 : 0;
      pairs.push_back({a, b});
      of_slots.push_back({static_cast<Slot>(a + in * grains), static_cast<Slot>(b + in * grains)});
    }
    StepState state = state_of(2 * static_cast<std::size_t>(grains), of_slots, {});
    Decomposition& all = state.decomposition;
    all.partition.subdomains = 2;
    for (Slot s = 0; s < 2 * grains; ++s) {
      const Slot k = s % grains;
      state.bodies.id[static_cast<std::size_t>(s)] = BodyId{static_cast<std::int64_t>(k)};
      all.multiplicity.push_back(shared(k) ? 2 : 1);
      all.counts.push_back(s < grains ? shared(k) || home(k) == 0 : !shared(k) && home(k) == 1);
    }
    for (int hold = 2; hold <= 4; ++hold)
      EXPECT_EQ(coordination(state, graph::one_rank(), hold),
                by_definition(static_cast<std::size_t>(grains), pairs, {}, hold))
          << trial << ' ' << hold;
  }
}

TEST(Coordination, WeightHoldsAGrainOnThree) {
  StepParameters parameters;
  EXPECT_EQ(contacts_to_hold(parameters), 4);
  parameters.gravity = Vec3(0, 0, -9.81);
  EXPECT_EQ(contacts_to_hold(parameters), 3);
  parameters.friction = true;
  EXPECT_EQ(contacts_to_hold(parameters), 2);
}

}  // namespace
}  // namespace talus::coordination_test
