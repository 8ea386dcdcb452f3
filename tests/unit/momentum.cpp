/// Momentum and conjugate directions carry impulses and velocities alike.

#include "kernels/momentum.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "runtime/step/simulation.hpp"
#include "tests/unit/dense_sample.hpp"

namespace talus {
namespace {

TEST(Momentum, GoesOnBeyondTheLastSweepByBeta) {
  Contacts contacts;
  contacts.rn = {1.0, 2.0};
  Trail trail;
  allocate(trail, Carry::momentum, contacts, 0, 0);
  carry_impulses(Carry::momentum, 0, {0, 2}, contacts, trail);
  EXPECT_EQ(contacts.rn, (std::vector{1.0, 2.0}));  // the first sweep begins where it is
  contacts.rn = {1.5, 1.0};                         // what the sweep made of it
  carry_impulses(Carry::momentum, 0.5, {0, 2}, contacts, trail);
  EXPECT_EQ(contacts.rn, (std::vector{1.75, 0.5}));
}

TEST(Momentum, ConjugateDirectionIsTheWayOfTheSweepBefore) {
  Contacts contacts;
  contacts.rn = {1.0};
  Trail trail;
  allocate(trail, Carry::conjugate, contacts, 0, 0);
  carry_impulses(Carry::conjugate, 0, {0, 1}, contacts, trail);  // y0 = 1
  contacts.rn = {3.0};                                           // s
  carry_impulses(Carry::conjugate, 0.5, {0, 1}, contacts, trail);
  EXPECT_EQ(contacts.rn[0], 3.0);  // no direction before the first sweep: y1 = 3, p = 2
  contacts.rn = {4.0};
  carry_impulses(Carry::conjugate, 0.5, {0, 1}, contacts, trail);
  EXPECT_EQ(contacts.rn[0], 5.0);  // 4 + 0.5 * 2
}

TEST(Momentum, StaleTrailsAreNeverRead) {
  Contacts contacts;
  contacts.rn = {1.0};
  Trail trail;
  allocate(trail, Carry::momentum, contacts, 0, 0);
  trail.last.n = {std::numeric_limits<double>::quiet_NaN()};
  carry_impulses(Carry::momentum, 0, {0, 1}, contacts, trail);
  EXPECT_EQ(contacts.rn[0], 1.0);
}

struct Solved {
  StepReport report;
  std::vector<Velocity> velocity;
  std::uint64_t digest;
};

/// One step of 216 grains that fly at one another in a box.
Solved solve(SolverMethod method, double friction, double tolerance, int subdomains = 1, int threads = 1) {
  talus::Setup setup;
  setup.walls = test::box_of_walls(-0.5, 5.5);
  Stage stage;
  stage.name = "impact";
  stage.time_step = 1e-3;
  stage.law = {friction, friction, 0};
  stage.end.steps = 1;
  setup.stages = {stage};
  setup.solver.method = method;
  setup.solver.tolerance = tolerance;
  setup.solver.balance_tolerance = 1e9;
  setup.solver.max_iterations = 20000;
  setup.decomposition.subdomains = subdomains;
  graph::Executor executor({.threads = threads});
  Simulation simulation(setup, test::jittered_lattice(6, 11), executor);
  simulation.step();
  return {simulation.report(), simulation.state().bodies.velocity, simulation.digest()};
}

// The frictionless problem has one solution for the velocities, however it is reached.
TEST(Methods, AgreeWithoutFriction) {
  const Solved plain = solve(SolverMethod::nlgs, 0, 1e-11);
  ASSERT_TRUE(plain.report.converged);
  for (SolverMethod method : {SolverMethod::automatic, SolverMethod::momentum, SolverMethod::nncg}) {
    const Solved other = solve(method, 0, 1e-11);
    ASSERT_TRUE(other.report.converged) << static_cast<int>(method);
    EXPECT_LT(other.report.iterations, plain.report.iterations) << static_cast<int>(method);
    for (std::size_t s = 0; s < plain.velocity.size(); ++s)
      for (int k = 0; k < 3; ++k)
        ASSERT_NEAR(other.velocity[s].u[k], plain.velocity[s].u[k], 1e-8) << static_cast<int>(method);
  }
}

// What carries impulses on must carry velocities, walls and glued copies on alike: the check makes V afresh
// from r, and would see the difference.
TEST(Methods, ReachTheToleranceWithFrictionOnSubdomains) {
  for (SolverMethod method : {SolverMethod::automatic, SolverMethod::momentum, SolverMethod::nncg})
    for (int subdomains : {1, 2, 8}) {
      const Solved solved = solve(method, 0.3, 1e-4, subdomains);
      EXPECT_TRUE(solved.report.converged) << static_cast<int>(method) << " on " << subdomains;
    }
}

// The choice is made when the step begins; then it is the method itself.
TEST(Methods, AutoTakesConjugateGradientsForTightTolerancesWithFriction) {
  EXPECT_EQ(solve(SolverMethod::automatic, 0.3, 1e-6).digest, solve(SolverMethod::nncg, 0.3, 1e-6).digest);
  EXPECT_EQ(solve(SolverMethod::automatic, 0.3, 1e-4).digest,
            solve(SolverMethod::momentum, 0.3, 1e-4).digest);
}

TEST(Methods, GiveTheSameBitsOnAnyNumberOfThreads) {
  for (SolverMethod method : {SolverMethod::nlgs, SolverMethod::momentum, SolverMethod::nncg})
    EXPECT_EQ(solve(method, 0.3, 1e-4, 4, 1).digest, solve(method, 0.3, 1e-4, 4, 3).digest)
        << static_cast<int>(method);
}

}  // namespace
}  // namespace talus
