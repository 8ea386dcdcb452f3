/// What looks at all contacts of a step, on the state of a step that was made.

#include "runtime/step/global_solver.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "runtime/graph/executor.hpp"
#include "runtime/graph/one_rank.hpp"
#include "runtime/step/simulation.hpp"
#include "tests/unit/runtime/step/loose_scenes.hpp"

namespace talus::global_solver_test {
namespace {

/// Of two grains on a floor one flies into the other with a hundred times the momentum that gravity adds in a
/// step, and the floor then carries half of what it should. That is little to the pair; to the floor it is
/// little only if something else stands on it.
TEST(GlobalSolver, MeasuresWhatSmallClustersDoToAWallByAllThatItCarries) {
  constexpr double r = 0.01, h = 1e-3, speed = 1;
  talus::Setup setup = simulation_test::falling(1);
  setup.walls.resize(1);
  setup.solver.tolerance = 1e-9;
  Bodies bodies;
  add_sphere(bodies, BodyId{0}, Vec3(0, 0, r), r, 2600);
  add_sphere(bodies, BodyId{1}, Vec3(2 * r, 0, r), r, 2600);
  bodies.velocity[1].u[0] = -speed;
  bodies.x[1][0] += h / 2 * speed;  // they touch in the middle of the step
  const double weight = bodies.mass(0) * 10 * h;
  graph::Executor executor({.threads = 1});
  Simulation simulation(setup, std::move(bodies), executor);
  simulation.step();
  StepState state = simulation.state();
  std::size_t at_floor = 0;
  for (std::size_t k = 0; k < state.contacts.rn.size(); ++k)
    if (state.contacts.second[k] < 0) {
      EXPECT_NEAR(state.contacts.rn[k], weight, 1e-6 * weight);
      state.contacts.rn[k] /= 2;
      ++at_floor;
    }
  ASSERT_EQ(at_floor, 2u);
  const graph::OneRank ranks;
  const DecompositionSettings settings;
  Gluing gluing(state, settings, ranks);
  GlobalSolver solver(state, simulation.parameters(), settings, gluing, ranks);
  solver.find_clusters({}, false);
  ASSERT_TRUE(solver.small_clusters());
  state.wall_states[0].impulse.setZero();
  EXPECT_NEAR(solver.small_error(1e-6, 0, 1).relative, 0.5, 1e-3);
  state.wall_states[0].impulse = Vec3(0, 0, 1e4 * weight);
  EXPECT_LT(solver.small_error(1e-6, 0, 1).relative, 0.02);
}

/// Two grains on a floor, far from one another; what carries one of them is halved.
TEST(GlobalSolver, ComparesTheWorkInSeveralClustersWithAllFloors) {
  constexpr double r = 0.01, h = 1e-3;
  talus::Setup setup = simulation_test::falling(1);
  setup.walls.resize(1);
  setup.solver.tolerance = 1e-9;
  Bodies bodies;
  for (const int k : {0, 1}) add_sphere(bodies, BodyId{k}, Vec3(10 * k * r, 0, r), r, 2600);
  const double mass = bodies.mass(0), weight = mass * 10 * h;
  graph::Executor executor({.threads = 1});
  Simulation simulation(setup, std::move(bodies), executor);
  simulation.step();
  StepState state = simulation.state();
  const auto touches = std::ranges::find_if(state.contacts.rn, [](double rn) { return rn > 0; });
  ASSERT_NE(touches, state.contacts.rn.end());
  *touches /= 2;
  const graph::OneRank ranks;
  const DecompositionSettings settings;
  Gluing gluing(state, settings, ranks);
  GlobalSolver solver(state, simulation.parameters(), settings, gluing, ranks);
  solver.find_clusters({.bodies = 0, .smooth = 0, .loops = 0, .chained = 0}, false);
  ASSERT_TRUE(solver.several_large_clusters());
  // r_n e over m (v/2)^2/2, with v what gravity adds, r_n = m v/2 and e = v/2.
  EXPECT_NEAR(solver.large_work(0, 0), 2, 1e-6);
  const double work = mass * 0.01 * 0.01 / 4;
  EXPECT_NEAR(solver.large_work(3, 0), work / (0.5 * mass * 9), 1e-6 * work / mass);
  EXPECT_NEAR(solver.large_work(0, 100), work / (0.5 * 2500 * weight * weight / mass), 1e-9);
}

/// A block of 216 grains that touch along all axes: more bodies than are small with friction, fewer than are
/// without; its loops are no chain's.
TEST(GlobalSolver, TakesMoreBodiesForSmallWhereThereIsNoFriction) {
  constexpr double r = 0.01;
  constexpr int edge = 6;
  for (const double friction : {0.0, 0.3}) {
    talus::Setup setup = simulation_test::falling(1);
    setup.walls.resize(1);
    setup.stages[0].laws = laws_of_one_material(friction, friction, 0);
    Bodies bodies;
    for (int k = 0; k < edge * edge * edge; ++k)
      add_sphere(bodies, BodyId{k},
                 r * Vec3(2 * (k % edge), 2 * (k / edge % edge), 1 + 2 * (k / edge / edge)), r, 2600);
    graph::Executor executor({.threads = 1});
    Simulation simulation(setup, std::move(bodies), executor);
    simulation.step();
    StepState state = simulation.state();
    const graph::OneRank ranks;
    const DecompositionSettings settings;
    Gluing gluing(state, settings, ranks);
    GlobalSolver solver(state, simulation.parameters(), settings, gluing, ranks);
    solver.find_clusters({}, false);
    EXPECT_EQ(solver.small_clusters(), friction == 0);
    EXPECT_EQ(solver.large_clusters(), friction > 0);
    solver.find_clusters({}, true);
    EXPECT_EQ(solver.small_clusters(), friction == 0);
    EXPECT_TRUE(solver.large_clusters()) << "looked at twice";
  }
}

}  // namespace
}  // namespace talus::global_solver_test
