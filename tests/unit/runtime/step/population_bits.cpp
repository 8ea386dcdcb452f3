/// Grains that come and go: nothing depends on threads or ranks, a run goes on as it was.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <utility>

#include "runtime/graph/one_rank.hpp"
#include "runtime/graph/pretend_ranks.hpp"
#include "tests/unit/runtime/step/population_scenes.hpp"

namespace talus::population_test {
namespace {

TEST(Population, TheSameBitsOnAnyThreads) {
  for (const int subdomains : {1, 3}) {
    const talus::Setup setup = busy_setup(subdomains, 110);
    EXPECT_EQ(run(setup, {}, 1), run(setup, {}, 3)) << subdomains;
  }
}

TEST(Population, TheSameBitsOnAnyRanks) {
  for (const bool orientation : {false, true}) {
    talus::Setup setup = busy_setup(4, 110);
    setup.orientation = orientation;
    const std::uint64_t one = run(setup);
    for (const int ranks : {2, 3, 4}) {
      std::uint64_t digest = 0;
      std::int64_t placed = 0, removed = 0;
      graph::on_pretend_ranks(ranks, [&](const graph::Communicator& world) {
        graph::Executor executor({.threads = 1});
        Simulation simulation(setup, Bodies{}, executor, world);
        while (!simulation.finished()) {
          simulation.step();
          simulation.begin_next_stage();
        }
        const std::uint64_t here = simulation.digest();
        if (world.rank() != 0) return;
        digest = here;
        placed = simulation.inserted()[0].placed;
        removed = simulation.removed()[0].count + simulation.removed()[1].count;
      });
      EXPECT_EQ(digest, one) << ranks;
      EXPECT_EQ(placed, 220);
      EXPECT_GT(removed, 20);
    }
  }
}

TEST(Population, ARunStoppedInTheMiddleGoesOnToTheSameBits) {
  for (const int subdomains : {1, 3}) {
    const talus::Setup setup = busy_setup(subdomains, 110);
    graph::Executor executor({.threads = 1});
    Simulation whole(setup, Bodies{}, executor);
    std::optional<Checkpoint> saved;
    while (!whole.finished()) {
      whole.step();
      whole.begin_next_stage();
      if (whole.report().step == 37) saved = whole.checkpoint();
    }
    Simulation rest(setup, *saved, executor, graph::one_rank());
    while (!rest.finished()) {
      rest.step();
      rest.begin_next_stage();
    }
    EXPECT_EQ(rest.digest(), whole.digest()) << subdomains;
    EXPECT_EQ(rest.inserted()[0].no_room, whole.inserted()[0].no_room);
    EXPECT_EQ(rest.removed()[0].mass, whole.removed()[0].mass);
  }
}

TEST(Population, WhenAllGrainsAreGoneTheRunGoesOn) {
  for (const int subdomains : {1, 3}) {
    talus::Setup setup = floor_setup(60);
    setup.decomposition.subdomains = subdomains;
    setup.inserts.push_back(rain(0));
    setup.inserts.front().rate.reset();
    setup.inserts.front().count = 20;
    setup.inserts.push_back(setup.inserts.front());
    setup.inserts.back().name = "again";
    setup.inserts.back().count = 1;
    setup.inserts.back().times.from = 0.04;
    setup.removes.push_back(removal(box({-1, -1, -1}, {1, 1, 1})));
    setup.removes.front().at = {0.02};
    graph::Executor executor({.threads = 2});
    Simulation simulation(setup, Bodies{}, executor);
    std::vector<std::int64_t> there;
    while (!simulation.finished()) {
      EXPECT_TRUE(simulation.step().converged);
      there.push_back(simulation.bodies());
      simulation.begin_next_stage();
    }
    EXPECT_EQ(there[10], 20);
    EXPECT_EQ(there[30], 0);
    EXPECT_EQ(there[50], 1);
    EXPECT_LT(simulation.state().bodies.x.capacity(), 100u);
  }
}

/// What rests keeps its forces when grains elsewhere come and go: the warm start outlives them.
TEST(Population, ImpulsesOfThoseThatStayAreKept) {
  talus::Setup setup = floor_setup(120);
  Bodies bodies;
  for (int k = 0; k < 8; ++k) add_sphere(bodies, BodyId{k}, {0.3, 0.3, 0.01 + 0.02 * k}, 0.01, density);
  InsertRule rule = rain(0);
  rule.rate.reset();
  rule.count = 5;
  rule.times.from = 0.1;
  setup.inserts.push_back(rule);
  setup.solver.tolerance = 1e-6;
  graph::Executor executor({.threads = 1});
  Simulation simulation(setup, std::move(bodies), executor);
  int before = 0;
  while (!simulation.finished()) {
    const StepReport& report = simulation.step();
    if (report.step == 100) before = report.iterations;
    if (report.step == 101) {
      EXPECT_EQ(simulation.bodies(), 13);
      EXPECT_LE(report.iterations, before + 10);
    }
    simulation.begin_next_stage();
  }
}

TEST(Population, ScenesWithoutRulesSayNothing) {
  graph::Executor executor({.threads = 1});
  Bodies bodies;
  add_sphere(bodies, BodyId{0}, {0, 0, 0.01}, 0.01, density);
  Simulation simulation(floor_setup(1), std::move(bodies), executor);
  simulation.step();
  EXPECT_TRUE(simulation.inserted().empty());
  EXPECT_TRUE(simulation.removed().empty());
}

}  // namespace
}  // namespace talus::population_test
