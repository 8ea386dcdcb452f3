// A step can be solved again: from a saved state, in other ways.

#include <gtest/gtest.h>

#include <cmath>

#include "runtime/step/simulation.hpp"
#include "tests/unit/dense_sample.hpp"

namespace talus {
namespace {

/// Grains that overlap in a box whose lid is pushed, with friction; the second stage subdomain colours
/// gravity on.
talus::Setup pressed_box() {
  talus::Setup setup;
  setup.walls = test::box_of_walls(-1, 6);
  for (Wall& wall : setup.walls)
    if (wall.name == "z+") wall.load = {.drive = WallDrive::force, .force = 1e5, .mass = 500};
  Stage press, hold;
  press.name = "press";
  press.time_step = hold.time_step = 1e-3;
  press.laws = hold.laws = laws_of_one_material(0.35, 0.2, 0);
  press.end.steps = 4;
  hold.name = "hold";
  hold.gravity = Vec3(0, 0, -9.81);
  hold.end.steps = 20;
  setup.stages = {press, hold};
  setup.solver.max_iterations = 300;
  return setup;
}

class SavedStates : public testing::Test {
 protected:
  /// The state behind `steps` steps.
  SavedState after(int steps) {
    Simulation simulation(setup_, test::jittered_lattice(6, 1, 0.1), executor_);
    for (int k = 0; k < steps; ++k) {
      simulation.step();
      simulation.begin_next_stage();
    }
    return simulation.save();
  }
  talus::Setup setup_ = pressed_box();
  graph::Executor executor_{{.threads = 1}};
};

TEST_F(SavedStates, GoOnAsTheSimulationItselfWouldHave) {
  for (const int steps : {0, 2, 4, 7}) {  // in the first stage, between the stages, in the second
    Simulation original(setup_, test::jittered_lattice(6, 1, 0.1), executor_);
    for (int k = 0; k < steps; ++k) {
      original.step();
      original.begin_next_stage();
    }
    Simulation again(setup_, original.save(), executor_);
    original.step();
    again.step();
    EXPECT_EQ(again.stage().name, original.stage().name);
    EXPECT_EQ(again.steps_of_stage(), original.steps_of_stage());
    EXPECT_EQ(again.report().step, original.report().step);
    EXPECT_EQ(again.report().time, original.report().time);
    EXPECT_EQ(again.report().contacts, original.report().contacts);
    // From the same impulses; candidates found anew stand in another order, and sums with them.
    const double error = original.error_history().front().error_rms;
    EXPECT_NEAR(again.error_history().front().error_rms, error, 1e-9 * error) << "after step " << steps;
    EXPECT_NEAR(again.report().kinetic_translation, original.report().kinetic_translation,
                0.05 * original.report().kinetic_translation);
  }
}

TEST_F(SavedStates, GiveTheSameBitsEveryTimeAndOnAnyNumberOfThreads) {
  const SavedState saved = after(3);
  graph::Executor three({.threads = 3});
  Simulation one(setup_, saved, executor_), two(setup_, saved, executor_), threads(setup_, saved, three);
  one.step();
  two.step();
  threads.step();
  EXPECT_EQ(one.digest(), two.digest());
  EXPECT_EQ(one.digest(), threads.digest());
}

TEST_F(SavedStates, CarryTheImpulsesIntoSubdomains) {
  const SavedState saved = after(3);
  talus::Setup cut = setup_;
  cut.decomposition.subdomains = 5;
  Simulation whole(setup_, saved, executor_), parts(cut, saved, executor_);
  whole.step();
  parts.step();
  const double error = whole.error_history().front().error_rms;
  EXPECT_EQ(parts.report().contacts, whole.report().contacts);
  EXPECT_NEAR(parts.error_history().front().error_rms, error, 1e-6 * error) << "the same impulses";
  cut.solver.warm_start = false;
  Simulation cold(cut, saved, executor_);
  cold.step();
  EXPECT_GT(std::abs(cold.error_history().front().error_rms - error), 0.1 * error);
  EXPECT_THROW(parts.save(), std::logic_error);
}

TEST_F(SavedStates, ChecksKnowWhenTheyWereMade) {
  Simulation simulation(setup_, after(1), executor_);
  simulation.step();
  const auto& history = simulation.error_history();
  ASSERT_GE(history.size(), 2U);
  EXPECT_GE(history.front().seconds, 0);
  for (std::size_t k = 1; k < history.size(); ++k) {
    EXPECT_GE(history[k].seconds, history[k - 1].seconds);
    EXPECT_GT(history[k].iterations, history[k - 1].iterations);
  }
  EXPECT_LE(history.back().seconds, simulation.report().wall_s);
}

}  // namespace
}  // namespace talus
