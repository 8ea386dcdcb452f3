/// When stages end.

#include <gtest/gtest.h>

#include <stdexcept>
#include <vector>

#include "runtime/step/simulation.hpp"
#include "tests/unit/runtime/step/loose_scenes.hpp"

namespace talus::simulation_test {
namespace {

// Inside a TEST, Setup is a private name of GoogleTest: there it is spelled talus::Setup.

TEST(Stages, EndByStepsByTimeAndByStrain) {
  graph::Executor executor({});
  talus::Setup setup;
  setup.walls = box(1, 1, 1);
  Stage by_steps = stage("steps", 7), by_time = stage("time", 0), by_strain = stage("strain", 1000);
  by_time.end = {};
  by_time.end.time = 0.013;
  by_strain.end.strain = 0.05;
  by_strain.end.strain_axis = 1;
  WallLoad squeeze;
  squeeze.drive = WallDrive::velocity;
  squeeze.velocity = Vec3(0, -2, 0);
  by_strain.loads = {{"y+", squeeze}};
  setup.stages = {by_steps, by_time, by_strain, stage("nothing", 0), stage("last", 2)};
  Simulation simulation(setup, Bodies{}, executor);
  std::vector<std::int64_t> steps(setup.stages.size(), 0);
  int begun = 0;
  while (!simulation.finished()) {
    ++steps[simulation.stage_index()];
    simulation.step();
    begun += simulation.begin_next_stage();
  }
  // ln(1 - 0.002 k) <= -0.05 first holds for k = 25.
  EXPECT_EQ(steps, (std::vector<std::int64_t>{7, 13, 25, 0, 2}));
  EXPECT_EQ(begun, 3) << "the empty stage is passed over";
  EXPECT_NEAR(simulation.report().time, 47e-3, 1e-12);
}

TEST(Stages, EndAtEquilibriumOnceThePileRests) {
  graph::Executor executor({});
  talus::Setup setup = falling(5000);
  setup.walls = box(2.1 * radius, 2.1 * radius, 1);
  setup.stages[0].end.equilibrium = 1e-6;
  setup.solver.tolerance = 1e-6;
  setup.solver.balance_tolerance = 1e-6;
  Simulation simulation(setup, loose_sample(1, 1, 4, 1), executor);
  while (!simulation.finished()) {
    simulation.step();
    simulation.begin_next_stage();
  }
  EXPECT_GT(simulation.report().step, 5);
  EXPECT_LT(simulation.report().step, 5000);
  double weight = 0;
  for (std::size_t s = 0; s < 4; ++s) weight += 10 * simulation.state().bodies.mass(s);
  EXPECT_NEAR(simulation.walls()[4].force[2], weight, 1e-5 * weight);
}

TEST(Stages, TooShortForAStepAreRefused) {
  talus::Setup setup;
  setup.stages = {stage("blink", 1)};
  setup.stages[0].end.steps.reset();
  for (const double part : {0.4, 0.5}) {
    setup.stages[0].end.time = part * setup.stages[0].time_step;
    EXPECT_THROW(validate(setup), std::invalid_argument) << part;
  }
  setup.stages[0].end.time = 0.51 * setup.stages[0].time_step;
  EXPECT_NO_THROW(validate(setup));
  graph::Executor executor({.threads = 1});
  EXPECT_FALSE(Simulation(setup, Bodies{}, executor).finished()) << "a step is to be made";
}

}  // namespace
}  // namespace talus::simulation_test
