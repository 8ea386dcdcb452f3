#include "runtime/step/dealing.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "runtime/graph/one_rank.hpp"
#include "runtime/step/simulation.hpp"

namespace talus {
namespace {

Sample some_grains(std::size_t count) {
  Sample sample;
  sample.density = 2600;
  SizeDistribution sizes;
  sizes.kind = SizeDistribution::Kind::uniform;
  sizes.min = 0.001;
  sizes.max = 0.02;
  sample.radius = draw_radii(sizes, count, 3);
  Lattice sites;
  sites.spacing = 0.041;
  sites.length_x = sites.length_y = 0.5;
  sample.x = lattice(sample.radius, sites);
  return sample;
}

TEST(Dealing, OnOneRankKeepsEveryGrain) {
  Sample sample = some_grains(300);
  sample.velocity.assign(300, {1, 2, 3, 4, 5, 6});
  Bodies expected;
  append(sample, expected);
  const Bodies dealt = deal_out(sample, {}, graph::one_rank());
  ASSERT_EQ(dealt.size(), 300u);
  EXPECT_EQ(digest(dealt), digest(expected));
  EXPECT_EQ(dealt.velocity[7].w[2], 6);
}

TEST(Dealing, GrainsThatDoNotTurnLoseTheirSpin) {
  Sample sample = some_grains(1);
  sample.velocity.assign(1, {1, 2, 3, 4, 5, 6});
  sample.rotates = false;
  Bodies bodies;
  append(sample, bodies);
  EXPECT_EQ(bodies.velocity[0].u[2], 3);
  EXPECT_EQ(bodies.velocity[0].w[2], 0);
  EXPECT_EQ(bodies.velocity[0].spin_mobility, 0);
}

TEST(SampleSize, HasTheSameBitsInAnyOrder) {
  Bodies bodies;
  append(some_grains(1000), bodies);
  const SampleSize size = measure_sample(bodies, graph::one_rank());
  std::vector<Slot> order(bodies.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](Slot a, Slot b) {
    return bodies.radius[static_cast<std::size_t>(a)] < bodies.radius[static_cast<std::size_t>(b)];
  });
  reorder(bodies, order);
  const SampleSize sorted = measure_sample(bodies, graph::one_rank());
  EXPECT_EQ(size.total_mass, sorted.total_mass);
  EXPECT_EQ(size.volume, sorted.volume);
  EXPECT_EQ(size.mean_diameter, sorted.mean_diameter);
  EXPECT_EQ(size.smallest, bodies.radius.front());
  EXPECT_NEAR(size.volume, total_volume(bodies), 1e-14 * size.volume);
  EXPECT_NEAR(size.total_mass, 2600 * size.volume, 1e-12 * size.total_mass);
}

TEST(SampleSize, OfNoGrainIsZero) {
  const SampleSize size = measure_sample({}, graph::one_rank());
  EXPECT_EQ(size.bodies, 0);
  EXPECT_EQ(size.total_mass, 0);
}

/// Half a step of predicted motion, before the first distribution, and half a step behind the solve.
TEST(FirstStep, OfSeveralSubdomainsMovesAFreeGrainAsOneDoes) {
  Sample sample;
  sample.density = 2600;
  sample.x = {Vec3(0, 0, 0), Vec3(1, 0, 0)};
  sample.radius = {0.1, 0.1};
  sample.velocity = {{-3, 0, 1, 0, 0, 0}, {5, 0, 0, 0, 0, 0}};
  talus::Setup setup;
  Stage stage;
  stage.name = "flight";
  stage.time_step = 1e-3;
  stage.end.steps = 1;
  setup.stages = {stage};
  for (int subdomains : {1, 2}) {
    setup.decomposition.subdomains = subdomains;
    graph::Executor executor({.threads = 1});
    Simulation simulation(setup, deal_out(sample, setup.decomposition, graph::one_rank()), executor);
    simulation.step();
    const Frame frame = simulation.frame();
    ASSERT_EQ(frame.id.size(), 2u);
    EXPECT_NEAR(frame.x[0].x(), -3e-3, 1e-15) << subdomains;
    EXPECT_NEAR(frame.x[1].x(), 1.005, 1e-15) << subdomains;
  }
}

}  // namespace
}  // namespace talus
