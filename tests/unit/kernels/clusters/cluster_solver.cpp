// What the answer of a cluster makes of the impulses that it has.

#include "kernels/clusters/cluster_solver.hpp"

#include <gtest/gtest.h>

#include "tests/unit/kernels/clusters/cluster_makers.hpp"

namespace talus::cluster_solver_test {
namespace {

using namespace cluster_makers;

/// A grain of 1 kg that comes along x at 1 m/s between two walls that press a thousand times as hard as it
/// pushes. Their impulses stop it but for `rest` [m/s].
BodyProblem squeezed(double rest) {
  BodyProblem problem;
  const std::int32_t grain = add_grain(problem, Vec3::Zero(), 0);
  problem.bodies[0].free.u = Vec3::UnitX();
  add_contact(problem, grain, -1, Vec3::UnitX(), 0, 0);
  add_contact(problem, grain, -1, -Vec3::UnitX(), 0, 1);
  problem.impulse[0] = 1000 * Vec3::UnitX();
  problem.impulse[1] = -(1001 - rest) * Vec3::UnitX();
  return problem;
}

/// By what walls press with velocities may be off a hundred times as much as by what the grain exchanges.
constexpr ClusterGoal goal{.enough = 1e-3 * 0.01 * 1000, .relative = 1e-3, .sweeps = 100};

TEST(ClusterSolver, KeepsForcesOfRedundantContactsWhoseVelocitiesAreRight) {
  const ClusterAnswer answer = solve_cluster(squeezed(5e-5), goal);
  ASSERT_TRUE(answer.solved());
  for (const Vec3& change : answer.impulse) EXPECT_EQ(change, Vec3(Vec3::Zero()));
}

TEST(ClusterSolver, ChangesForcesWhoseVelocitiesAreWrongByTheScaleOfWhatTheyDo) {
  const BodyProblem problem = squeezed(5e-4);
  const ClusterAnswer answer = solve_cluster(problem, goal);
  ASSERT_TRUE(answer.solved());
  EXPECT_NEAR((problem.impulse[0] + answer.impulse[0] + problem.impulse[1] + answer.impulse[1]).x(), -1,
              1e-6);
}

TEST(ClusterSolver, FindsWhoCarriesWhereAllButTheSameVelocitiesMeetTheLawButForRounding) {
  // With an excess the lid goes up, and grain b is free at first. Where contacts lean less than firm ones
  // give way no answer is better than a wrong one.
  int solved = 0;
  for (const double lid_mass : {0.01, 1.0, 100.0})
    for (const double excess : {0.0, 1e-6})
      for (const double lean : {1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6}) {
        const double apart = 0.5;
        const BodyProblem problem = under_a_lid(lean, apart * lean * lean, lid_mass, excess);
        const ClusterAnswer answer =
            solve_cluster(problem, {.enough = 1e-5, .relative = 1e-5, .sweeps = 100});
        if (!answer.solved()) continue;
        ++solved;
        const double a = -(problem.impulse[2] + answer.impulse[2]).z(),
                     b = -(problem.impulse[3] + answer.impulse[3]).z();
        // Velocities tell a grain that leans by less than this part of what is asked nothing of its force.
        if (lean > 1e-5) {
          EXPECT_NEAR(a - b, apart, 1e-3) << lean << ' ' << lid_mass << ' ' << excess;
        }
        const double give = lid_mass * lean * lean;  // of the lid, where all is on grain a
        EXPECT_NEAR(a + b, (1 - give * apart / 2) / (1 + give / 2), 1e-5)
            << lean << ' ' << lid_mass << ' ' << excess;
      }
  EXPECT_GE(solved, 24);
}

/// A grain of 1 kg that flies along two walls at 0.4 m/s, with friction, closes on one by `first` and on the
/// other by `second` [m/s], and is impulse-free.
BodyProblem along_walls(double first, double second) {
  BodyProblem problem;
  const std::int32_t grain = add_grain(problem, Vec3::Zero(), 0.4);
  problem.bodies[0].free.u = Vec3(-first, -second, 0.4);
  add_contact(problem, grain, -1, Vec3::UnitX(), 0.4, 0);
  add_contact(problem, grain, -1, Vec3(0.6, 0.8, 0), 0.4, 1);
  return problem;
}

TEST(ClusterSolver, LeavesGrainsAloneThatCloseOnWallsByLessThanRoundingOfPositions) {
  const double still = 1e-15;  // [m/s]
  for (const double first : {1e-18, -1e-18, 0.0, 4e-18})
    for (const double second : {1e-18, -1e-18, 2e-18, -4e-18}) {
      const ClusterAnswer answer = solve_cluster(
          along_walls(first, second), {.enough = 1e-15, .relative = 1e-2, .sweeps = 10, .still = still});
      EXPECT_TRUE(answer.solved()) << first << ' ' << second;
      EXPECT_LE(answer.error, 0.1 * still) << first << ' ' << second;  // of 1 kg
    }
}

TEST(ClusterSolver, StopsGrainsThatCloseOnWallsFasterThanRounding) {
  const BodyProblem problem = along_walls(1e-3, 1e-3);
  const ClusterAnswer answer =
      solve_cluster(problem, {.enough = 1e-8, .relative = 1e-2, .sweeps = 100, .still = 1e-15});
  ASSERT_TRUE(answer.solved());
  EXPECT_GE((problem.bodies[0].free.u + answer.motion[0].u).x(), -1e-8);
}

}  // namespace
}  // namespace talus::cluster_solver_test
