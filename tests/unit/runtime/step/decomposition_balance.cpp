/// When space is cut anew, and what subdomains have equal shares of.

#include <gtest/gtest.h>

#include <vector>

#include "tests/unit/runtime/step/cut_boxes.hpp"

namespace talus::decomposition_test {
namespace {

/// Dense below, loose above: a cut into equal numbers of grains leaves the contacts unequal.
Bodies settled_below() {
  Bodies bodies = lattice(6, 5);
  for (std::size_t s = 0; s < bodies.size(); ++s)
    if (bodies.x[s][2] > 0.063) bodies.x[s][2] += bodies.x[s][2] - 0.063;
  return bodies;
}

/// What is cut anew after the first step is so at once, or never.
talus::Setup settling(std::int64_t steps) {
  talus::Setup setup = pressed_box(0.3, steps);
  setup.walls = test::box_of_walls(0, 0.19);
  setup.stages[0].gravity = Vec3(0, 0, -9.81);
  choose(setup, variants[1], 4);
  setup.decomposition.balance = BalanceBy::contacts;
  setup.decomposition.repartition_every = 1000;
  setup.decomposition.max_imbalance = 1e9;
  return setup;
}

TEST(Decomposition, CutsSpaceByGrainsUntilItKnowsTheContacts) {
  EXPECT_GT(run(settling(1), settled_below()).last.imbalance, 1.2);
  EXPECT_LT(run(settling(2), settled_below()).last.imbalance, 1.1);
}

TEST(Decomposition, CutsSpaceAnewAtOnceWhenContactsAreOutOfBalance) {
  talus::Setup setup = settling(30);
  const double left_alone = run(setup, settled_below()).last.imbalance;
  setup.decomposition.max_imbalance = 0.1;
  const double cut_anew = run(setup, settled_below()).last.imbalance;
  EXPECT_GT(left_alone, 1.2);
  EXPECT_LT(cut_anew, 1.1);
}

// A row of three: the middle one has two neighbours and the copies of both cuts.
TEST(Decomposition, CountsTheGluingAmongTheWork) {
  talus::Setup setup = pressed_box(0.3, 3);
  setup.walls = test::box_of_walls(0, 0.19);
  choose(setup, variants[0], 3);
  setup.decomposition.partitioner = PartitionKind::fitted;
  setup.decomposition.boxes = {1, 1, 3};
  std::vector<std::vector<int>> contacts;
  for (const BalanceBy balance : {BalanceBy::contacts, BalanceBy::work}) {
    setup.decomposition.balance = balance;
    graph::Executor executor({.threads = 1});
    Simulation simulation(setup, lattice(6, 5), executor);
    for (int k = 0; k < 3; ++k) simulation.step();
    const Chunks& chunks = simulation.state().chunks;
    std::vector<int>& of = contacts.emplace_back(3, 0);
    for (std::size_t c = 0; c < chunks.size(); ++c)
      of[static_cast<std::size_t>(chunks.subdomain[c])] += chunks.begin[c + 1] - chunks.begin[c];
  }
  EXPECT_NEAR(contacts[0][1], contacts[0][0], 5);
  EXPECT_LT(contacts[1][1], 0.9 * contacts[1][0]);
  EXPECT_LT(contacts[1][1], 0.9 * contacts[1][2]);
}

TEST(Decomposition, BalancesByMeasuredTimeWhenAskedTo) {
  talus::Setup setup = pressed_box(0.3, 8);
  choose(setup, variants[1], 4);
  setup.decomposition.balance = BalanceBy::time;
  setup.decomposition.repartition_every = 2;
  setup.solver.tolerance = 1e-4;
  const Outcome outcome = run(setup, lattice(6, 5));
  EXPECT_LE(outcome.unconverged, 1);       // cuts follow the clock here, and the sweeps of a step the cuts
  EXPECT_LT(outcome.last.imbalance, 2.5);  // every subdomain has its share, if not an equal one
  EXPECT_GT(outcome.last.contacts, 250);
}

}  // namespace
}  // namespace talus::decomposition_test
