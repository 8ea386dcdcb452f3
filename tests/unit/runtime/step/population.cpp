/// Grains that come and go: mass and number are kept, nothing depends on threads or ranks, a run goes on.

#include "runtime/step/population.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <utility>

#include "runtime/graph/one_rank.hpp"
#include "runtime/graph/pretend_ranks.hpp"
#include "runtime/step/simulation.hpp"

namespace talus::population_test {
namespace {

constexpr double density = 2500, time_step = 1e-3;

Region box(const Vec3& low, const Vec3& high) {
  Region region;
  region.low = low;
  region.high = high;
  return region;
}

Region below(double z) {
  Region region;
  region.kind = Region::Kind::beyond;
  region.point = {0, 0, z};
  region.normal = {0, 0, -1};
  return region;
}

/// A floor at z = 0, gravity, and nothing else.
talus::Setup floor_setup(std::int64_t steps) {
  talus::Setup setup;
  Wall floor;
  floor.name = "floor";
  setup.walls.push_back(floor);
  Stage stage;
  stage.name = "run";
  stage.time_step = time_step;
  stage.gravity = {0, 0, -9.81};
  stage.laws.set_all(&PairLaw::friction, 0.3);
  stage.end.steps = steps;
  setup.stages.push_back(stage);
  return setup;
}

InsertRule rain(double rate) {
  InsertRule rule;
  rule.name = "rain";
  rule.region = box({0, 0, 0.1}, {0.1, 0.1, 0.15});
  rule.radii.kind = SizeDistribution::Kind::uniform;
  rule.radii.min = 0.004;
  rule.radii.max = 0.006;
  rule.density = density;
  rule.velocity = {0, 0, -1};
  rule.rate = rate;
  return rule;
}

RemoveRule removal(const Region& region) {
  RemoveRule rule;
  rule.name = "out";
  rule.region = region;
  return rule;
}

double mass_of(const Simulation& simulation) {
  double mass = 0;
  const Bodies& bodies = simulation.state().bodies;
  for (std::size_t s = 0; s < bodies.size(); ++s)
    if (counts(simulation.state().decomposition, s))
      mass += 1 / whole_velocity(simulation.state().decomposition, bodies, s).inv_mass;
  return mass;
}

std::uint64_t run(const talus::Setup& setup, Bodies bodies = {}, int threads = 1) {
  graph::Executor executor({.threads = threads});
  Simulation simulation(setup, std::move(bodies), executor);
  while (!simulation.finished()) {
    simulation.step();
    simulation.begin_next_stage();
  }
  return simulation.digest();
}

/// Rain, grains at once beside it, and two removals.
talus::Setup busy_setup(int subdomains, std::int64_t steps) {
  talus::Setup setup = floor_setup(steps);
  setup.inserts.push_back(rain(2000));
  setup.inserts.push_back(rain(0));
  setup.inserts.back().name = "blocks";
  setup.inserts.back().rate.reset();
  setup.inserts.back().count = 60;
  setup.inserts.back().times.from = 0.02;
  setup.inserts.back().region = box({0.1, 0, 0}, {0.2, 0.1, 0.1});
  setup.removes.push_back(removal(box({-1, -1, -1}, {0.05, 1, 0.03})));
  setup.removes.back().times.interval = 0.004;
  setup.removes.push_back(removal(below(0.02)));
  setup.removes.back().name = "sweep";
  setup.removes.back().at = {0.05, 0.09};
  setup.decomposition.subdomains = subdomains;
  setup.decomposition.repartition_every = 3;
  return setup;
}

/// Rain at a rate, and a hole in the floor's corner: what came less what went is there, to the grain.
TEST(Population, NumberAndMassAreKept) {
  talus::Setup setup = floor_setup(400);
  setup.inserts.push_back(rain(500));
  setup.removes.push_back(removal(box({-1, -1, -1}, {0.05, 0.05, 0.02})));
  graph::Executor executor({.threads = 1});
  Simulation simulation(setup, Bodies{}, executor);
  std::set<BodyId> seen;
  std::int64_t largest = -1;
  while (!simulation.finished()) {
    const std::set<BodyId> before(simulation.state().bodies.id.begin(), simulation.state().bodies.id.end());
    simulation.step();
    for (const BodyId id : simulation.state().bodies.id)
      if (!before.contains(id)) {
        EXPECT_TRUE(seen.insert(id).second) << "an id came back";
        EXPECT_GT(static_cast<std::int64_t>(id), largest);
      }
    for (const BodyId id : simulation.state().bodies.id)
      largest = std::max(largest, static_cast<std::int64_t>(id));
    const InsertReport in = simulation.inserted().front();
    const RemoveReport out = simulation.removed().front();
    ASSERT_EQ(in.placed - out.count, simulation.bodies());
    ASSERT_NEAR(in.mass - out.mass, mass_of(simulation), 1e-12 * in.mass);
    // The asked rate to the grain, as there is room.
    ASSERT_LE(std::abs(static_cast<double>(in.placed) - 500 * simulation.report().time), 1);
    simulation.begin_next_stage();
  }
  EXPECT_GT(simulation.removed().front().count, 10);
  EXPECT_GT(simulation.bodies(), 100);
}

TEST(Population, ARateOfMassIsKeptToAGrain) {
  talus::Setup setup = floor_setup(300);
  setup.inserts.push_back(rain(0));
  setup.inserts.front().rate.reset();
  setup.inserts.front().mass_rate = 0.5;
  graph::Executor executor({.threads = 1});
  Simulation simulation(setup, Bodies{}, executor);
  while (!simulation.finished()) {
    simulation.step();
    const double asked = 0.5 * simulation.report().time, there = simulation.inserted().front().mass;
    ASSERT_LE(there, asked * (1 + 1e-9));
    ASSERT_GT(there, asked - sphere_mass(0.006, density));
    simulation.begin_next_stage();
  }
}

/// No two grains overlap where they come: that is the worst that a first step could show.
TEST(Population, GrainsThatComeAtOnceOverlapNothing) {
  talus::Setup setup = floor_setup(1);
  setup.inserts.push_back(rain(0));
  InsertRule& rule = setup.inserts.front();
  rule.rate.reset();
  rule.count = 120;
  rule.velocity = Vec3::Zero();
  setup.stages.front().gravity = Vec3::Zero();
  graph::Executor executor({.threads = 1});
  Simulation simulation(setup, Bodies{}, executor);
  simulation.step();
  const Bodies& bodies = simulation.state().bodies;
  ASSERT_EQ(bodies.size(), 120u);
  for (std::size_t a = 0; a < bodies.size(); ++a) {
    EXPECT_TRUE(holds(rule.region, bodies.x[a], bodies.radius[a] * (1 - 1e-9)));
    for (std::size_t b = 0; b < a; ++b)
      ASSERT_GE((bodies.x[a] - bodies.x[b]).norm(), bodies.radius[a] + bodies.radius[b]);
  }
}

/// More than fits: what finds room comes, the rest is said to wait, and comes when there is room again.
TEST(Population, GrainsWithoutRoomWaitAndComeLater) {
  talus::Setup setup = floor_setup(200);
  setup.inserts.push_back(rain(0));
  InsertRule& rule = setup.inserts.front();
  rule.rate.reset();
  rule.count = 1500;
  graph::Executor executor({.threads = 1});
  Simulation simulation(setup, Bodies{}, executor);
  simulation.step();
  const InsertReport first = simulation.inserted().front();
  EXPECT_EQ(first.placed + first.waiting, 1500);
  EXPECT_GT(first.placed, 200);
  EXPECT_GT(first.waiting, 500);
  EXPECT_EQ(first.no_room, 1);
  while (!simulation.finished()) {
    simulation.step();
    simulation.begin_next_stage();
  }
  const InsertReport last = simulation.inserted().front();
  EXPECT_GT(last.placed, first.placed + 200);
  EXPECT_EQ(last.placed + last.waiting, 1500);
}

/// A ball that stays takes most of the region, and one place a step is tried: each grain gets another chance
/// at another place, until it has come.
TEST(Population, GrainsWithoutRoomTryOtherPlacesLater) {
  talus::Setup setup = floor_setup(400);
  setup.stages.front().gravity = Vec3::Zero();
  setup.inserts.push_back(rain(0));
  InsertRule& rule = setup.inserts.front();
  rule.rate.reset();
  rule.count = 12;
  rule.attempts = 1;
  rule.velocity = Vec3::Zero();
  rule.radii.kind = SizeDistribution::Kind::constant;
  rule.radii.min = rule.radii.max = 0.002;
  Bodies bodies;
  add_sphere(bodies, BodyId{0}, Vec3(0.05, 0.05, 0.125), 0.05, density);
  graph::Executor executor({.threads = 1});
  Simulation simulation(setup, std::move(bodies), executor);
  simulation.step();
  EXPECT_LT(simulation.inserted().front().placed, 12);
  while (!simulation.finished()) {
    simulation.step();
    simulation.begin_next_stage();
  }
  EXPECT_EQ(simulation.inserted().front().placed, 12);
}

/// They are solid spheres in whichever subdomain they land, also behind a repartition.
TEST(Population, GrainsThatComeTurnAsOthersDoInSubdomains) {
  graph::Executor executor({.threads = 1});
  Simulation simulation(busy_setup(4, 60), Bodies{}, executor);
  while (!simulation.finished()) {
    simulation.step();
    const StepState& state = simulation.state();
    for (std::size_t s = 0; s < state.bodies.size(); ++s) {
      const Velocity v = whole_velocity(state.decomposition, state.bodies, s);
      ASSERT_NEAR(v.spin_mobility, 2.5 * v.inv_mass, 1e-12 * v.inv_mass) << simulation.report().step;
    }
    simulation.begin_next_stage();
  }
  EXPECT_GT(simulation.bodies(), 50);
}

/// What a damaged checkpoint, or that of another scene, has too much or too little of is not read.
TEST(Population, ACheckpointOfOtherRulesIsRefused) {
  talus::Setup setup = floor_setup(1);
  setup.inserts = {rain(100), rain(200)};
  setup.removes = {removal(below(0))};
  Population population(setup, Bodies{}, graph::one_rank());
  const PopulationState right = population.state();
  EXPECT_NO_THROW(population.go_on_from(right));
  int arrays = 0;
  PopulationState wrong = right;
  PopulationState::each_number(wrong, [&](const char* name, auto& member) {
    if constexpr (requires { member.push_back({}); }) {
      ++arrays;
      member.push_back({});
      EXPECT_THROW(population.go_on_from(wrong), std::invalid_argument) << name;
      member.pop_back();
    }
  });
  EXPECT_EQ(arrays, 15);
  wrong.tracked_rule = {2};
  wrong.tracked_id = {0};
  EXPECT_THROW(population.go_on_from(wrong), std::invalid_argument) << "there are two insertions";
  wrong = right;
  wrong.waiting_count = {1, -1};
  EXPECT_THROW(population.go_on_from(wrong), std::invalid_argument);
}

/// Large grains are not left out because they fit less often.
TEST(Population, RadiiThatComeAreThoseOfTheDistribution) {
  talus::Setup setup = floor_setup(300);
  setup.inserts.push_back(rain(600));
  graph::Executor executor({.threads = 1});
  Simulation simulation(setup, Bodies{}, executor);
  while (!simulation.finished()) {
    simulation.step();
    simulation.begin_next_stage();
  }
  std::vector<double> radii = simulation.state().bodies.radius;
  std::vector<double> drawn = draw_radii(setup.inserts.front().radii, radii.size(), setup.seed, 0x8000);
  std::ranges::sort(radii);
  std::ranges::sort(drawn);
  EXPECT_EQ(radii, drawn);
}

TEST(Population, ARemovalAtATimeOutsideItsOwnTimesIsRefused) {
  talus::Setup setup = floor_setup(10);
  setup.removes = {removal(below(0))};
  RemoveRule& rule = setup.removes.front();
  rule.at = {0.05};
  EXPECT_NO_THROW(validate(setup));
  rule.times.from = 0.06;
  EXPECT_THROW(validate(setup), std::invalid_argument) << "it would act late";
  rule.times = {.from = 0, .until = 0.01, .stage = {}, .interval = 0};
  EXPECT_THROW(validate(setup), std::invalid_argument) << "it would never act";
}

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
