/// Grains that come and go: mass and number are kept.

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

// A stage that was to end when its grains rest ended as the last one was taken away.
TEST(Population, ThatIsGoneIsInNoEquilibrium) {
  talus::Setup setup = floor_setup(20);
  setup.stages[0].end.equilibrium = 1e-3;
  setup.stages[0].end.equilibrium_hold = 0;
  setup.removes = {removal(below(1))};
  setup.removes.front().at = {0.01};
  Bodies bodies;
  add_sphere(bodies, BodyId{0}, {0, 0, 0.5}, 0.005, density);
  graph::Executor executor({.threads = 1});
  Simulation simulation(setup, std::move(bodies), executor);
  while (simulation.stage_fraction() < 1) simulation.step();
  EXPECT_EQ(simulation.bodies(), 0);
  EXPECT_STREQ(simulation.end_reached(), "steps");
  EXPECT_EQ(simulation.report().step, 20);
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

}  // namespace
}  // namespace talus::population_test
