/// What a simulation refuses to begin with, and what it stops at.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include "runtime/step/runaway.hpp"
#include "runtime/step/simulation.hpp"
#include "tests/unit/runtime/step/loose_scenes.hpp"

namespace talus::simulation_test {
namespace {

// Inside a TEST, Setup is a private name of GoogleTest: there it is spelled talus::Setup.

TEST(Simulation, RefusesSettingsThatMakeNoSense) {
  const auto refused = [](const auto& change) {
    talus::Setup setup;
    setup.stages = {stage("fall", 1)};
    validate(setup);
    change(setup);
    EXPECT_THROW(validate(setup), std::invalid_argument);
  };
  refused([](talus::Setup& s) { s.solver.overlap_correction = 1.1; });
  refused([](talus::Setup& s) { s.solver.overlap_correction = std::numeric_limits<double>::quiet_NaN(); });
  refused([](talus::Setup& s) { s.solver.check_every = 1; });
  refused([](talus::Setup& s) { s.decomposition.repartition_every = 0; });
  refused([](talus::Setup& s) {
    s.decomposition.coupling = Coupling::nscdd;
    s.decomposition.sweeps_per_exchange = 0;
  });
}

TEST(Simulation, RefusesMomentumOnSchwarz) {
  talus::Setup setup;
  setup.stages = {stage("fall", 1)};
  setup.solver.method = SolverMethod::momentum;
  EXPECT_NO_THROW(validate(setup));
  setup.decomposition.coupling = Coupling::schwarz;
  EXPECT_THROW(validate(setup), std::invalid_argument);
}

std::string runaway_message(const Setup& setup, Bodies bodies, int threads) {
  graph::Executor executor({.threads = threads});
  Simulation simulation(setup, std::move(bodies), executor);
  try {
    while (!simulation.finished()) {
      simulation.step();
      simulation.begin_next_stage();
    }
  } catch (const RunawayError& error) {
    return error.what();
  }
  return "no error";
}

/// A slip of the pen in a rate, which would fill all memory within a step.
TEST(Simulation, RefusesMoreGrainsThanCanEverWaitByTheNameOfTheirRule) {
  talus::Setup setup = falling(5);
  InsertRule rule;
  rule.name = "rain";
  rule.region.high = Vec3(0.1, 0.1, 0.1);
  rule.radii.max = 0.01;
  rule.density = 2500;
  rule.rate = 1e12;
  setup.inserts.push_back(rule);
  graph::Executor executor({.threads = 1});
  Simulation simulation(setup, Bodies{}, executor);
  try {
    simulation.step();
    FAIL() << "a billion grains wait";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("insert 'rain': more than"), std::string::npos) << error.what();
  }
}

TEST(Simulation, RefusesABodyThatIsNotFinite) {
  graph::Executor executor({.threads = 1});
  Bodies bodies = loose_sample(4, 4, 4, 1);
  bodies.velocity[37].u[1] = std::numeric_limits<double>::quiet_NaN();
  try {
    Simulation simulation(falling(5), bodies, executor);
    FAIL() << "taken";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("body 37"), std::string::npos) << error.what();
  }
}

TEST(Runaway, OfAnOverflowStopsWithItsStepStageAndBody) {
  for (int threads : {1, 2}) {
    Bodies bodies = loose_sample(4, 4, 4, 1);
    bodies.velocity[37].u[1] = 1e200;
    const std::string message = runaway_message(falling(5), bodies, threads);
    EXPECT_NE(message.find("step 1 "), std::string::npos) << message;
    EXPECT_NE(message.find("'fall'"), std::string::npos) << message;
    EXPECT_NE(message.find("body 37:"), std::string::npos) << message;
  }
}

/// A cell that is pressed has as much to give as it would move by without contacts.
TEST(Runaway, IsNoneOfWhatAStressedCellSupplies) {
  StepState state;
  state.cell.follows[0] = true;
  state.cell.mass = 4;
  state.cell.length = 0.5;
  state.cell.push[0] = 2;
  state.cell.push[1] = 100;  // prescribed: not a freedom
  state.flow.before(0, 0) = 3;
  EXPECT_DOUBLE_EQ(free_energy_of(state), 0.5 * 4 * (0.5 * 3 + 2.0 / 4) * (0.5 * 3 + 2.0 / 4));
  state.cell.follows[0] = false;
  EXPECT_EQ(free_energy_of(state), 0);
}

TEST(Runaway, OfEnergyThatNothingSuppliedStopsWithItsStepAndBody) {
  talus::Setup setup;
  setup.stages = {stage("release", 1)};
  Bodies one;
  add_sphere(one, BodyId{5}, Vec3::Zero(), radius, density);
  one.velocity[0].u[0] = 1;
  graph::Executor executor({.threads = 1});
  Simulation simulation(setup, one, executor);
  simulation.step();
  StepSums sums = simulation.sums();
  SampleSize size;
  IterationResult result = simulation.iterations();
  const StepOutcome outcome{
      {1, "release"}, simulation.setup(), size, simulation.parameters(), simulation.state(), sums, result};
  result.converged = false;
  EXPECT_NO_THROW(check_for_runaway(outcome, 0));
  sums.motion.energy_free /= 1000;  // as if a step had made that much of it
  result.converged = true;
  EXPECT_NO_THROW(check_for_runaway(outcome, 0));
  result.converged = false;
  try {
    check_for_runaway(outcome, 0);
    FAIL() << "went on";
  } catch (const RunawayError& error) {
    const std::string message = error.what();
    EXPECT_NE(message.find("kinetic energy"), std::string::npos) << message;
    EXPECT_NE(message.find("'release'"), std::string::npos) << message;
    EXPECT_NE(message.find("body 5"), std::string::npos) << message;
  }
}

// Rates that are given close a cell whatever its grains bear, and one may begin too full.
TEST(Runaway, OfACellThatIsLessThanItsGrainsHasNoRoom) {
  for (const double rate : {0.0, -1e-3}) {
    talus::Setup setup;
    setup.domain = periodic_domain({1, 1, 1});
    setup.stages = {stage("close", 1)};
    setup.stages[0].strain_rates[2] = rate;
    Bodies one;
    add_sphere(one, BodyId{5}, Vec3(0.5, 0.5, 0.5), 0.01, density);
    graph::Executor executor({.threads = 1});
    Simulation simulation(setup, one, executor);
    simulation.step();
    SampleSize size;
    const StepSums& sums = simulation.sums();
    const StepOutcome outcome{
        {1, "close"}, simulation.setup(),     size, simulation.parameters(), simulation.state(),
        sums,         simulation.iterations()};
    size.volume = 0.99;
    EXPECT_NO_THROW(check_for_runaway(outcome, 0));
    size.volume = 1.01;
    try {
      check_for_runaway(outcome, 0);
      FAIL() << "went on";
    } catch (const NoSpaceError& error) {
      const std::string message = error.what();
      EXPECT_NE(message.find(rate == 0 ? "make it larger" : "End the stage sooner"), std::string::npos)
          << message;
    }
  }
}

/// Of three balls that touch above a floor, two fall at 1 cm/s and the third waits: behind the impact
/// rounding of a position is all that moves them, many times the motion that is left of theirs.
TEST(Simulation, TakesTheRoundingOfAPositionForNoRunaway) {
  talus::Setup setup = falling(20);
  setup.stages[0].gravity.setZero();
  setup.stages[0].time_step = 1e-3;
  setup.walls = {Wall{}};
  Bodies column;
  for (const int k : {0, 1, 2}) {
    add_sphere(column, BodyId{k}, Vec3(0, 0, 0.0123 + 0.0246 * k), 0.0123, 2600);
    column.velocity.back().u[2] = k == 1 ? 0 : -0.01;
  }
  EXPECT_EQ(runaway_message(setup, column, 1), "no error");
}

/// A plane that leans over the floor by 0.02 comes down on a grain without friction, which has to leave 50
/// times as fast, with 1250 times the energy that it would have at the speed of the plane.
TEST(Simulation, TakesAGrainThatAWedgeThrowsOutForNoRunaway) {
  constexpr double lean = 0.02, speed = 1e-3;
  talus::Setup setup = falling(1);
  setup.stages[0].gravity.setZero();
  Wall plane;
  plane.name = "plane";
  plane.normal = Vec3(std::sin(lean), 0, -std::cos(lean));
  plane.point = Vec3(0, 0, radius) - radius * plane.normal;
  plane.load = {.drive = WallDrive::velocity, .velocity = speed * plane.normal};
  plane.velocity = plane.load.velocity;
  setup.walls = {Wall{}, plane};
  Bodies one;
  add_sphere(one, BodyId{0}, Vec3(0, 0, radius), radius, density);
  graph::Executor executor({.threads = 1});
  Simulation simulation(setup, one, executor);
  EXPECT_TRUE(simulation.step().converged);
  EXPECT_NEAR(simulation.state().bodies.velocity[0].u[0], speed / std::sin(lean), 0.01 * speed / lean);
}

}  // namespace
}  // namespace talus::simulation_test
