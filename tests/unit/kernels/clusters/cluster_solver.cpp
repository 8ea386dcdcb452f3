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
  ASSERT_TRUE(answer.solved);
  for (const Vec3& change : answer.impulse) EXPECT_EQ(change, Vec3(Vec3::Zero()));
}

TEST(ClusterSolver, ChangesForcesWhoseVelocitiesAreWrongByTheScaleOfWhatTheyDo) {
  const BodyProblem problem = squeezed(5e-4);
  const ClusterAnswer answer = solve_cluster(problem, goal);
  ASSERT_TRUE(answer.solved);
  EXPECT_NEAR((problem.impulse[0] + answer.impulse[0] + problem.impulse[1] + answer.impulse[1]).x(), -1,
              1e-6);
}

}  // namespace
}  // namespace talus::cluster_solver_test
