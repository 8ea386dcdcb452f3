#pragma once

/// Scenes into which grains come and out of which they go, for the tests of population.hpp.

#include <cstdint>
#include <utility>

#include "runtime/step/population.hpp"
#include "runtime/step/simulation.hpp"

namespace talus::population_test {

inline constexpr double density = 2500, time_step = 1e-3;

inline Region box(const Vec3& low, const Vec3& high) {
  Region region;
  region.low = low;
  region.high = high;
  return region;
}

inline Region below(double z) {
  Region region;
  region.kind = Region::Kind::beyond;
  region.point = {0, 0, z};
  region.normal = {0, 0, -1};
  return region;
}

/// A floor at z = 0, gravity, and nothing else.
inline talus::Setup floor_setup(std::int64_t steps) {
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

inline InsertRule rain(double rate) {
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

inline RemoveRule removal(const Region& region) {
  RemoveRule rule;
  rule.name = "out";
  rule.region = region;
  return rule;
}

inline double mass_of(const Simulation& simulation) {
  double mass = 0;
  const Bodies& bodies = simulation.state().bodies;
  for (std::size_t s = 0; s < bodies.size(); ++s)
    if (counts(simulation.state().decomposition, s))
      mass += 1 / whole_velocity(simulation.state().decomposition, bodies, s).inv_mass;
  return mass;
}

inline std::uint64_t run(const talus::Setup& setup, Bodies bodies = {}, int threads = 1) {
  graph::Executor executor({.threads = threads});
  Simulation simulation(setup, std::move(bodies), executor);
  while (!simulation.finished()) {
    simulation.step();
    simulation.begin_next_stage();
  }
  return simulation.digest();
}

/// Rain, grains at once beside it, and two removals.
inline talus::Setup busy_setup(int subdomains, std::int64_t steps) {
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

}  // namespace talus::population_test
