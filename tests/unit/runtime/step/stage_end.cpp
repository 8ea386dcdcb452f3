#include "runtime/step/stage_end.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "runtime/step/cell_report.hpp"
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

/// A cubic lattice of touching spheres in a cell under a stress: it rests, and carries what it is asked for.
constexpr double density = 1000;
Simulation lattice(const StressLoad& load, const StageEnd& end, graph::Executor& executor) {
  talus::Setup setup;
  setup.domain = periodic_domain(Vec3::Constant(8 * radius));
  setup.decomposition.coupling = Coupling::nscdd;
  setup.solver.tolerance = setup.solver.balance_tolerance = 1e-8;  // stresses exact
  Stage& stage = setup.stages.emplace_back();
  stage.name = "press";
  stage.time_step = h;
  stage.stress = load;
  stage.end = end;
  stage.end.steps = 500;
  Bodies bodies;
  for (int k = 0; k < 64; ++k)
    add_sphere(bodies, BodyId{k}, radius * Vec3(2 * (k % 4) + 1, 2 * (k / 4 % 4) + 1, 2 * (k / 16) + 1),
               radius, density);
  return {setup, std::move(bodies), executor};
}

// Of tension the ratio is negative: a stage that waits for a shear does not end by a pull.
TEST(StressRatio, HasTheSignOfThePressure) {
  EXPECT_DOUBLE_EQ(stress_ratio(Vec3(1, 1, 4).asDiagonal()), 1.5);
  EXPECT_DOUBLE_EQ(stress_ratio(Vec3(-1, -1, -4).asDiagonal()), -1.5);
  EXPECT_EQ(stress_ratio(Mat3::Zero()), 0);
}

// q/p = (zz - 1)/((zz + 2)/3) of stresses (1, 1, zz) kPa, with zz from 1 to 4 kPa in 0.3 s, as a step's
// middle has it: 0.75 at 2 kPa, which the 101st step is the first to reach.
TEST(StressRatio, EndsAStageWithTheStepThatReachesIt) {
  StressLoad load;
  load.to = {1e3, 1e3, 4e3, {}, {}, {}};
  load.ramp_time = 0.3;
  graph::Executor executor({});
  StageEnd end;
  end.stress_ratio = 0.75;
  talus::Setup setup = lattice(load, end, executor).setup();
  // A stage before, from whose stress the ramp comes.
  setup.stages.insert(setup.stages.begin(), setup.stages.front());
  setup.stages[0].name = "before";
  setup.stages[0].stress.to = {1e3, 1e3, 1e3, {}, {}, {}};
  setup.stages[0].stress.ramp_time = 0;
  setup.stages[0].end = {};
  setup.stages[0].end.steps = 5;
  Bodies bodies = lattice(load, end, executor).state().bodies;
  Simulation simulation(setup, std::move(bodies), executor);
  while (!simulation.finished()) {
    ASSERT_TRUE(simulation.step().converged);
    if (simulation.stage_fraction() >= 1 && simulation.stage_index() == 1) break;
    simulation.begin_next_stage();
  }
  EXPECT_STREQ(simulation.end_reached(), "stress_ratio");
  EXPECT_EQ(simulation.steps_of_stage(), 101);
}

// 200 steps of 5e-4 each make a strain of 0.1, though their sum may fall short of that by rounding.
TEST(Strain, IsReachedByStepsWhoseSumRoundingLeavesShort) {
  Stage stage;
  stage.end.strain = stage.end.shear_strain = 0.1;
  const StageClock clock;
  const StageMemory memory;
  for (const double short_by : {1e-15, 1e-6}) {
    StageProgress progress{.steps = 200, .clock = clock, .memory = memory};
    progress.strain = -0.1 * (1 - short_by);
    EXPECT_EQ(stage_done(stage, progress).fraction >= 1, short_by < 1e-9);
    std::swap(progress.strain, progress.sheared);
    progress.sheared *= -1;
    EXPECT_EQ(stage_done(stage, progress).fraction >= 1, short_by < 1e-9);
  }
}

// Cubes of smooth grains bear no shear: a cell that is sheared ever faster by a stress is in no equilibrium,
// though its normal stresses are.
TEST(Equilibrium, OfACellIsThatOfAllComponentsThatFollow) {
  StressLoad load;
  load.to = {1e3, 1e3, 1e3, {}, 3e2, {}};
  StageEnd end;
  end.equilibrium = 0.01;
  graph::Executor executor({});
  Simulation simulation = lattice(load, end, executor);
  for (int step = 0; step < 3; ++step) {
    const StepReport& report = simulation.step();
    EXPECT_GT(report.equilibrium, 0.29) << step;
    EXPECT_LT(report.equilibrium, 0.31) << step;
  }
}

// d root of rho over p = 0.02 sqrt(1000/1000) s: three of them are 60 steps.
TEST(InertialNumber, MustBeLowForInertialTimesAlsoAcrossASavedState) {
  StressLoad load;
  load.to = {1e3, 1e3, 1e3, {}, {}, {}};
  StageEnd end;
  end.inertial_below = 1e-6;
  graph::Executor executor({});
  Simulation simulation = lattice(load, end, executor);
  for (int k = 0; k < 25; ++k) simulation.step();
  Simulation rest(simulation.setup(), simulation.save(), executor);
  for (Simulation* each : {&simulation, &rest}) {
    while (each->stage_fraction() < 1) each->step();
    EXPECT_STREQ(each->end_reached(), "inertial_below");
    EXPECT_NEAR(static_cast<double>(each->report().step), 60, 1);  // p is 1 kPa within the tolerance
  }
  EXPECT_EQ(simulation.report().step, rest.report().step);
}

TEST(InertialNumber, AboveABoundCountsFromTheLastStepBelowIt) {
  StageEnd end;
  end.inertial_above = 0.01;
  end.inertial_hold = 2;
  const StageStep fast{.time_step = 0.5, .inertial_time = 1, .shear_rate = 0.02};
  StageStep slow = fast, loose = fast;
  slow.shear_rate = 0.009;
  loose.inertial_time = 0;  // no pressure: no inertial number
  talus::Stage stage;
  stage.end = end;
  const StageClock clock;
  StageMemory memory;
  const auto ended_after = [&](std::initializer_list<StageStep> steps) {
    for (const StageStep& step : steps) memory.add(end, step);
    return stage_done(stage, {1, clock, 0, 0, 0, 0, memory}).fraction >= 1;
  };
  EXPECT_FALSE(ended_after({fast, fast, fast, slow}));
  EXPECT_FALSE(ended_after({fast, fast, fast, loose}));
  EXPECT_FALSE(ended_after({fast, fast, fast}));
  EXPECT_TRUE(ended_after({fast}));
}

// Means of 0.3 + exp(-t) over windows of length w: each is 0.3 + exp(-t_begin) (1 - exp(-w))/w, so that the
// drift from one to the next is exp(-t_begin) (1 - exp(-w))^2/w at t_begin of the earlier one.
TEST(SteadyState, EndsWhereTheDriftOfMeansFallsBelowTheBound) {
  const double w = 0.5, bound = 0.01, dt = 1e-3;
  StageEnd end;
  end.steady = bound;
  end.steady_time = w;
  talus::Stage stage;
  stage.end = end;
  const StageClock clock;
  StageMemory memory;
  std::int64_t steps = 0;
  do {
    const double t = (static_cast<double>(steps) + 0.5) * dt;
    memory.add(end, {.time_step = dt, .stress_ratio = 0.3 + std::exp(-t), .solid_fraction = 0.6});
    ++steps;
  } while (stage_done(stage, {steps, clock, 0, 0, 0, 0, memory}).fraction < 1 && steps < 100000);
  const double gone = 1 - std::exp(-w), begin = std::log(gone * gone / w / bound);
  EXPECT_EQ(steps, static_cast<std::int64_t>(std::ceil(begin / w) + 2) * 500);
}

// The ratio is steady at once; the sample dilates with the shear g as 0.6 - g, by 0.1 from window to window.
TEST(SteadyState, WatchesTheSolidFractionOverThePathOfShear) {
  StageEnd end;
  end.steady_strain = 0.1;
  talus::Stage stage;
  const StageClock clock;
  for (const double bound : {0.09, 0.11}) {
    end.steady = bound;
    stage.end = end;
    StageMemory memory;
    for (int k = 0; k < 40; ++k)
      memory.add(end, {.time_step = 1, .shear = 0.01, .stress_ratio = 0.3, .solid_fraction = 0.6 - 0.01 * k});
    EXPECT_EQ(stage_done(stage, {40, clock, 0, 0, 0, 0, memory}).fraction >= 1, bound > 0.1) << bound;
  }
}

// Grains that have not met press nothing, and their cell keeps its volume: that is no steady state. A gas in
// which they meet in few steps may have one.
TEST(SteadyState, IsNotReachedBeforeAnythingPresses) {
  talus::Stage stage;
  stage.end.steady = 0.01;
  stage.end.steady_time = 10;
  const StageClock clock;
  for (const int meeting : {0, 5}) {
    StageMemory memory;
    for (int k = 0; k < 100; ++k)
      memory.add(
          stage.end,
          {.time_step = 1, .stress_ratio = meeting > 0 && k % meeting == 0 ? 0.3 : 0, .solid_fraction = 0.1});
    EXPECT_EQ(stage_done(stage, {100, clock, 0, 0, 0, 0, memory}).fraction >= 1, meeting > 0);
  }
}

}  // namespace
}  // namespace talus::stage_end_test
