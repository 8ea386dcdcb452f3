#include "runtime/step/stage_end.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "runtime/step/simulation.hpp"
#include "tests/unit/dense_sample.hpp"

namespace talus::stage_end_test {
namespace {

constexpr double radius = 0.01, h = 1e-3;

/// A smooth ball that touches a plane, at rest, under gravity of 10 m/s^2 that has the part `along` along it.
Simulation on_plane(double along, double bound, double hold, graph::Executor& executor) {
  talus::Setup setup;
  Stage& stage = setup.stages.emplace_back();
  stage.name = "rest";
  stage.time_step = h;
  stage.gravity = 10 * Vec3(along, 0, -std::sqrt(1 - along * along));
  stage.end.steps = 2000;
  stage.end.equilibrium = bound;
  stage.end.equilibrium_hold = hold;
  Wall& floor = setup.walls.emplace_back();
  floor.name = "floor";
  floor.normal = Vec3::UnitZ();
  Bodies bodies;
  add_sphere(bodies, BodyId{0}, Vec3(0, 0, radius), radius, 2600);
  return {setup, std::move(bodies), executor};
}

// A free fall by the diameter takes 63 ms: three of them are 190 steps, not the one after which a ball at
// rest is found at rest.
TEST(Equilibrium, MustHoldForFreeFallsOfAGrain) {
  for (const double hold : {3.0, 0.5, 0.0}) {
    graph::Executor executor({});
    Simulation simulation = on_plane(0, 1e-3, hold, executor);
    while (simulation.stage_fraction() < 1) simulation.step();
    EXPECT_STREQ(simulation.end_reached(), "equilibrium");
    EXPECT_EQ(simulation.report().step, std::max(1.0, std::ceil(hold * std::sqrt(2 * 2 * radius / 10) / h)));
  }
}

// A ball that slides off with a fifth of gravity is within a bound of 0.21 when it begins: by its net force,
// 0.2 of its weight, and its energy, next to none. It goes on to gain any energy.
TEST(Equilibrium, IsNotReachedByWhatHasJustBegunToMove) {
  graph::Executor executor({});
  Simulation simulation = on_plane(0.2, 0.21, 3, executor);
  EXPECT_NEAR(simulation.step().equilibrium, 0.2, 1e-9);
  while (simulation.stage_fraction() < 1) simulation.step();
  EXPECT_STREQ(simulation.end_reached(), "steps");
  const double speed = 0.2 * 10 * 2000 * h;
  EXPECT_NEAR(simulation.report().equilibrium, speed * speed / 2 / (10 * 2 * radius), 1e-6);
}

TEST(Equilibrium, HoldIsPartOfASavedState) {
  graph::Executor executor({});
  Simulation simulation = on_plane(0, 1e-3, 3, executor);
  for (int k = 0; k < 100; ++k) simulation.step();
  Simulation second(simulation.setup(), simulation.save(), executor);
  while (second.stage_fraction() < 1) second.step();
  EXPECT_EQ(second.report().step, 190);
}

}  // namespace
}  // namespace talus::stage_end_test
