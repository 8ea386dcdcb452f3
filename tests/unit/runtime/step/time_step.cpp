#include "runtime/step/time_step.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <vector>

#include "runtime/graph/pretend_ranks.hpp"
#include "runtime/step/runaway.hpp"
#include "runtime/step/simulation.hpp"
#include "tests/unit/dense_sample.hpp"

namespace talus::time_step_test {
namespace {

constexpr double radius = 0.01, density = 2600, infinity = std::numeric_limits<double>::infinity();

Stage choosing(double end, double longest = 0) {
  Stage stage;
  stage.name = "all";
  stage.chooses_time_step = true;
  stage.time_step_max = longest;
  stage.gravity = Vec3(0, 0, -10);
  stage.end.time = end;
  return stage;
}

talus::Setup above_floor(Stage stage) {
  talus::Setup setup;
  setup.stages.push_back(std::move(stage));
  Wall& floor = setup.walls.emplace_back();
  floor.name = "floor";
  floor.normal = Vec3::UnitZ();
  return setup;
}

void add_ball(Bodies& bodies, const Vec3& x, const Vec3& u) {
  add_sphere(bodies, BodyId{static_cast<std::int64_t>(bodies.size())}, x, radius, density);
  for (int axis = 0; axis < 3; ++axis) bodies.velocity.back().u[axis] = u[axis];
}

// Whatever is asked for: between the bounds, no longer than asked where that is possible, no more than twice
// the step before, and the end of the stage is met to the bit.
TEST(StageClock, MeetsTheEndOfItsStage) {
  test::Random random(3);
  for (const double end : {1.0, 0.1, 0.37}) {
    const TimeStepBounds bounds{4e-3, 1e-5};
    StageClock clock(bounds, end, 2.5);
    double before = infinity, time = 0;
    while (clock.fraction() < 1) {
      const double asked = std::pow(10, test::uniform(random, -5.5, -1));
      clock.choose(asked);
      const double step = clock.step();
      EXPECT_LE(step, bounds.longest);
      EXPECT_GE(step, bounds.shortest);
      EXPECT_LE(step, 2 * before * (1 + 1e-15));
      EXPECT_TRUE(step <= asked || step < 2 * bounds.shortest) << step << " where " << asked << " was asked";
      clock.advance();
      before = step;
      time += step;
    }
    EXPECT_NEAR(time, end, 1e-12);
    EXPECT_EQ(clock.fraction(), 1);
    EXPECT_DOUBLE_EQ(clock.time(), 2.5 + end);
  }
}

// Ends that need not be a multiple of any step of the old one; steps of 4 ms went 5 % too far once.
TEST(StageClock, MeetsAnEndThatIsMovedToWithinAShortestStep) {
  for (const double end : {0.05, 0.0301, 0.052, 0.017}) {
    const TimeStepBounds bounds{4e-3, 4e-6};
    StageClock clock(bounds, 0.03, 0);
    const auto go_on = [&](double until) {
      while (clock.fraction() < until) {
        clock.choose(infinity);
        clock.advance();
      }
    };
    go_on(0.5);
    clock.move_end(end);
    go_on(1);
    EXPECT_GE(clock.time(), end * (1 - 1e-12)) << end;
    EXPECT_LT(clock.time(), end + 2 * bounds.shortest) << end;
  }
}

TEST(StageClock, HasTheShortestStepThatIsAskedFor) {
  Stage stage;
  stage.gravity = {0, 0, -9.81};
  stage.time_step_min = 0.02;
  EXPECT_EQ(time_step_bounds(stage, {}, 1e-4).longest, 0.02);
  EXPECT_EQ(time_step_bounds(stage, {}, 1e-4).shortest, 0.02);
}

TEST(StageClock, TakesTheLongestStepsAgainWhenItMay) {
  StageClock clock({1e-3, 1e-6}, std::nullopt, 0);
  clock.choose(1e-5);
  EXPECT_DOUBLE_EQ(clock.step(), 1e-3 / 128);
  int steps = 0;
  for (; clock.step() < 1e-3; ++steps) {
    clock.advance();
    clock.choose(infinity);
  }
  EXPECT_LE(steps, 2 * 7);
  EXPECT_EQ(clock.fraction(), 0);
}

// One long flight in steps of many lengths: the theta-scheme is exact under gravity, whatever they are.
TEST(ChosenTimeStep, FallsExactlyAndHitsTheEnd) {
  Bodies bodies;
  add_ball(bodies, Vec3(0, 0, 10), Vec3::Zero());
  const double end = 1.1;
  graph::Executor executor({});
  Simulation simulation(above_floor(choosing(end)), std::move(bodies), executor);
  double shortest = infinity, longest = 0, sum = 0;
  for (; !simulation.finished(); simulation.begin_next_stage()) {
    const StepReport& report = simulation.step();
    shortest = std::min(shortest, report.time_step);
    longest = std::max(longest, report.time_step);
    sum += report.time_step;
    EXPECT_NEAR(report.time, sum, 1e-12);
    EXPECT_TRUE(report.converged);
    EXPECT_NEAR(simulation.state().bodies.x[0][2], 10 - 0.5 * 10 * sum * sum, 1e-11);
  }
  EXPECT_DOUBLE_EQ(simulation.report().time, end);
  EXPECT_GT(longest, 3 * shortest) << "a fast grain takes shorter steps";
  EXPECT_LE(longest, std::sqrt(0.05 * radius / 10)) << "a grain at rest falls by 2.5 % of its radius at most";
}

/// Largest overlap [radii] and steps of three balls in a row: the first flies at 3.2 m/s into the second,
/// which then meets a third that it did not come near before.
std::pair<double, std::int64_t> struck(Stage stage) {
  Bodies bodies;
  add_ball(bodies, Vec3(0, 0, 1), Vec3(3.2, 0, 0));
  add_ball(bodies, Vec3(0.5, 0, 1), Vec3::Zero());
  add_ball(bodies, Vec3(0.5 + 2.12 * radius, 0, 1), Vec3::Zero());
  stage.laws = laws_of_one_material(0, 0, 0.5);
  stage.gravity = Vec3::Zero();
  graph::Executor executor({});
  Simulation simulation(above_floor(std::move(stage)), std::move(bodies), executor);
  double worst = 0;
  for (; !simulation.finished(); simulation.begin_next_stage())
    worst = std::max(worst, simulation.step().penetration_max);
  return {worst, simulation.report().step};
}

TEST(ChosenTimeStep, KeepsImpactsWithinTheOverlapTolerance) {
  Stage fixed = choosing(0.3);
  fixed.chooses_time_step = false;
  fixed.time_step = 1.25e-3;
  EXPECT_GT(struck(fixed).first, 0.05);
  const auto [overlap, steps] = struck(choosing(0.3, 4e-3));
  EXPECT_LE(overlap, 0.05);
  fixed.time_step = 0.05 * radius / 3.2;
  EXPECT_LT(static_cast<double>(steps), 0.3 / fixed.time_step) << "fewer than a fixed step that would do";
}

// A column of 20 at rest beside a ball whose flight makes steps short, with no sweeps to speak of: the force
// on the floor stays the weight only if warm impulses follow the time step.
TEST(ChosenTimeStep, TakesWarmImpulsesAlong) {
  Bodies bodies;
  for (int k = 0; k < 20; ++k) add_ball(bodies, Vec3(0, 0, (2 * k + 1) * radius), Vec3::Zero());
  const double weight = 10 * 20 * bodies.mass(0);
  add_ball(bodies, Vec3(1, 0, 3), Vec3::Zero());
  Stage rest = choosing(0.01, 1e-3), flight = choosing(0.6, 1e-3);
  rest.name = "rest";
  flight.name = "flight";
  talus::Setup setup = above_floor(rest);
  setup.stages.push_back(flight);
  setup.solver.tolerance = 1e-8;
  setup.solver.balance_tolerance = 1e-8;
  graph::Executor executor({});
  Simulation solved(setup, std::move(bodies), executor);
  while (solved.stage_index() == 0) {
    solved.step();
    solved.begin_next_stage();
  }
  setup.solver.max_iterations = 1;
  Simulation simulation(setup, solved.save(), executor);
  double shortest = infinity, longest = 0;
  for (; !simulation.finished(); simulation.begin_next_stage()) {
    const StepReport& report = simulation.step();
    shortest = std::min(shortest, report.time_step);
    longest = std::max(longest, report.time_step);
    ASSERT_NEAR(simulation.walls()[0].force[2], weight, 1e-4 * weight) << "step " << report.step;
  }
  EXPECT_GT(longest, shortest);
}

TEST(ChosenTimeStep, GoesOnFromASavedState) {
  Bodies bodies;
  for (int k = 0; k < 5; ++k)
    add_ball(bodies, Vec3(0.3 * k * radius, 0, (3 * k + 1) * radius), Vec3(0, 0, -0.5 * k));
  const talus::Setup setup = above_floor(choosing(0.05));
  graph::Executor executor({});
  Simulation whole(setup, bodies, executor), first(setup, bodies, executor);
  for (int k = 0; k < 9; ++k) {
    first.step();
    first.begin_next_stage();
  }
  Simulation second(setup, first.save(), executor);
  for (Simulation* simulation : {&whole, &second})
    for (; !simulation->finished(); simulation->begin_next_stage()) simulation->step();
  EXPECT_EQ(second.report().time, whole.report().time);
  EXPECT_EQ(second.report().step, whole.report().step);
}

// Steps are decided from maxima over all ranks: the same steps, and the same bits, on 1 and 3.
TEST(ChosenTimeStep, IsTheSameOnAnyRanksAndThreads) {
  talus::Setup setup = test::pressed_setup(test::box_of_walls(-1, 7), 0.3, 10, 1e3, 200);
  setup.stages[0].chooses_time_step = true;
  setup.stages[0].time_step_max = 0.1;
  setup.solver.max_iterations = 40;
  setup.decomposition.subdomains = 6;
  const Bodies bodies = test::jittered_lattice(7, 4, 5);
  struct Result {
    std::vector<double> steps;
    std::uint64_t digest = 0;
  };
  const auto run = [&](const graph::Communicator& ranks, int threads) {
    graph::Executor executor({.threads = threads});
    Simulation simulation(setup, ranks.rank() == 0 ? bodies : Bodies{}, executor, ranks);
    Result result;
    for (; !simulation.finished(); simulation.begin_next_stage())
      result.steps.push_back(simulation.step().time_step);
    result.digest = simulation.digest();
    return result;
  };
  Result alone;
  graph::on_pretend_ranks(1, [&](const graph::Communicator& ranks) { alone = run(ranks, 1); });
  EXPECT_LT(*std::ranges::min_element(alone.steps), *std::ranges::max_element(alone.steps))
      << testing::PrintToString(alone.steps);
  std::mutex comparing;
  const auto expect_same = [&](const Result& result) {
    const std::lock_guard lock(comparing);
    EXPECT_EQ(result.steps, alone.steps);
    EXPECT_EQ(result.digest, alone.digest);
  };
  graph::on_pretend_ranks(3, [&](const graph::Communicator& ranks) { expect_same(run(ranks, 1)); });
  graph::on_pretend_ranks(1, [&](const graph::Communicator& ranks) { expect_same(run(ranks, 2)); });
}

/// A grain in the way of one above it, which the flow of the cell carries over it: the velocity [m/s] along z
/// that their collision leaves between them.
double parted_by_a_flow(double rate, bool chosen, std::vector<double>& steps) {
  Stage stage = choosing(2 / rate);
  stage.gravity *= 1e-3;  // else the time of free fall would shorten the steps
  stage.shear_rates = Vec3(0, rate, 0);
  stage.chooses_time_step = chosen;
  stage.time_step = 1e-3 / rate;
  talus::Setup setup;
  setup.domain = periodic_domain(Vec3::Constant(10 * radius));
  setup.stages.push_back(stage);
  Bodies bodies;
  const Vec3 below(5 * radius, 5 * radius, 3.5 * radius);
  add_ball(bodies, below, Vec3::Zero());
  add_ball(bodies, below + Vec3(-1.2 * radius, 0, 1.9 * radius), Vec3::Zero());
  graph::Executor executor({});
  Simulation simulation(setup, bodies, executor);
  for (; !simulation.finished(); simulation.begin_next_stage()) {
    steps.push_back(simulation.step().time_step);
    EXPECT_TRUE(simulation.report().converged);
  }
  const std::vector<Velocity>& v = simulation.state().bodies.velocity;
  return v[1].u[2] - v[0].u[2];
}

// A flow that begins within a step does not show in the velocities before it: unless steps are chosen by it,
// grains are carried through one another without a contact.
TEST(ChosenTimeStep, IsShortEnoughForAFlowThatBegins) {
  constexpr double rate = 10;
  std::vector<double> chosen, given;
  const double parted = parted_by_a_flow(rate, true, chosen);
  for (const double step : chosen) EXPECT_LE(step * rate, 0.1);
  EXPECT_LT(chosen.front(), chosen.back());
  EXPECT_GT(parted, 0.1 * rate * radius);
  EXPECT_NEAR(parted, parted_by_a_flow(rate, false, given), 0.3 * parted);
}

// A cell whose shear goes on has nothing to fear of a change; one whose shear begins, turns or stops has; and
// components that follow a stress are not changed by the stage.
TEST(ChosenTimeStep, IsBoundedByChangesOfAFlow) {
  constexpr double rate = 2, reach = 3 * radius;
  const SolverSettings solver;
  StepState state;
  StepParameters parameters;
  const auto longest = [&] { return longest_step_of_flow(state, solver, parameters, radius, reach); };
  EXPECT_EQ(longest(), infinity) << "there is no cell";
  state.domain = periodic_domain(Vec3::Constant(10 * radius));
  EXPECT_EQ(longest(), infinity) << "nothing flows";
  parameters.velocity_gradient(0, 2) = rate;
  const double unseen = TimeStepRule{}.part_of_tolerance * solver.overlap_tolerance * radius;
  EXPECT_DOUBLE_EQ(longest(), unseen / (rate * reach)) << "it begins";
  state.cell.follows[4] = true;
  EXPECT_DOUBLE_EQ(longest(), 0.1 / rate) << "it follows a stress";
  state.cell.follows[4] = false;
  state.domain.rates.xz = rate * 10 * radius;
  EXPECT_DOUBLE_EQ(longest(), 0.1 / rate) << "it goes on";
  parameters.velocity_gradient(0, 2) = -rate;
  EXPECT_NEAR(longest(), unseen / (2 * rate * reach), 1e-12) << "it turns";
  parameters.velocity_gradient.setZero();
  EXPECT_NEAR(longest(), unseen / (rate * reach), 1e-12) << "it stops";
}

TEST(ChosenTimeStep, IsRefusedWhereItMayNotBeShortEnoughForAFlow) {
  graph::Executor executor({});
  Bodies bodies;
  add_ball(bodies, Vec3::Constant(5 * radius), Vec3::Zero());
  talus::Setup setup;
  setup.domain = periodic_domain(Vec3::Constant(10 * radius));
  setup.stages.push_back(choosing(1e3, 0.5));
  setup.stages[0].shear_rates = Vec3(0, 1, 0);
  setup.stages[0].time_step_min = 0.2;
  EXPECT_THROW(Simulation(setup, bodies, executor), std::invalid_argument);
  setup.stages[0].time_step_min = 0.1;  // to the rounding
  EXPECT_NO_THROW(Simulation(setup, bodies, executor));
  // The shortest step that weak gravity asks for.
  setup.stages[0].time_step_min = setup.stages[0].time_step_max = 0;
  setup.stages[0].gravity = Vec3(0, 0, -1e-8);
  Simulation late(setup, bodies, executor);
  EXPECT_THROW(late.step(), RunawayError);
}

TEST(ChosenTimeStep, NeedsABoundWithoutGravity) {
  graph::Executor executor({});
  Stage stage = choosing(1);
  stage.gravity.setZero();
  EXPECT_THROW(Simulation(above_floor(stage), Bodies{}, executor), std::invalid_argument);
  stage.time_step_max = 1e-3;
  stage.time_step_min = 2e-3;
  EXPECT_THROW(Simulation(above_floor(stage), Bodies{}, executor), std::invalid_argument);
  stage.time_step_min = 1e-5;
  EXPECT_NO_THROW(Simulation(above_floor(stage), Bodies{}, executor));
}

}  // namespace
}  // namespace talus::time_step_test
