/// Momentum and conjugate directions carry impulses and velocities alike.

#include "kernels/sweeps/momentum.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "runtime/step/simulation.hpp"
#include "tests/unit/dense_sample.hpp"

namespace talus {
namespace {

const SweepKernels kernels(InstructionSet::automatic);

/// A sweep with momentum is a plain sweep of what has gone on by beta times the last step, to the bit; with
/// beta = 0 it is the plain sweep.
template <bool Friction>
void expect_plain_sweeps_of_what_went_on() {
  const test::Sample sample = test::dense_sample(5, 3, Friction, false, 60);
  Contacts with = sample.contacts, plain = with;
  std::vector<Velocity> velocity = sample.bodies.velocity, same = velocity;
  AccelerationHistory acceleration;
  allocate(acceleration, Carry::momentum, with, {velocity.size(), sample.chunks.size(), 0});
  begin_steps({0, with.rx.size() + with.rn.size()}, acceleration.steps);
  for (const double beta : {0.0, 0.0, 0.5, 0.9}) {
    const auto go_on = [&](std::vector<double>& r, const std::vector<float>& step) {
      for (std::size_t k = 0; k < r.size(); ++k) r[k] = std::fma(beta, step[k], r[k]);
    };
    go_on(plain.rx, acceleration.steps.x);
    go_on(plain.ry, acceleration.steps.y);
    go_on(plain.rz, acceleration.steps.z);
    go_on(plain.rn, acceleration.steps.n);
    for (std::size_t c = 0; c < sample.chunks.size(); ++c) {
      if (sample.chunks.wall[c] >= 0) continue;
      kernels.sweep_grains<Friction>(with, sample.range(c), velocity, 0.3,
                                     SweepMomentum{beta, 1, acceleration.steps});
      kernels.sweep_grains<Friction>(plain, sample.range(c), same, 0.3);
    }
    EXPECT_EQ(with.rx, plain.rx) << beta;
    EXPECT_EQ(with.rz, plain.rz) << beta;
    EXPECT_EQ(with.rn, plain.rn) << beta;
  }
}

TEST(Momentum, SweepsWhatGoesOnBeyondTheLastSweepByBeta) {
  expect_plain_sweeps_of_what_went_on<true>();
  expect_plain_sweeps_of_what_went_on<false>();
}

TEST(Momentum, ConjugateDirectionIsTheWayOfTheSweepBefore) {
  Contacts contacts;
  contacts.rn = {1.0};
  AccelerationHistory acceleration;
  allocate(acceleration, Carry::conjugate, contacts, {0, 0, 0});
  carry_impulses(0, {0, 1}, contacts, acceleration);  // y0 = 1
  contacts.rn = {3.0};                                // s
  carry_impulses(0.5, {0, 1}, contacts, acceleration);
  EXPECT_EQ(contacts.rn[0], 3.0);  // no direction before the first sweep: y1 = 3, p = 2
  contacts.rn = {4.0};
  carry_impulses(0.5, {0, 1}, contacts, acceleration);
  EXPECT_EQ(contacts.rn[0], 5.0);  // 4 + 0.5 * 2
}

TEST(Momentum, StaleTrailsAreNeverRead) {
  Contacts contacts;
  contacts.rn = {1.0};
  AccelerationHistory acceleration;
  allocate(acceleration, Carry::conjugate, contacts, {0, 0, 0});
  acceleration.last.n = acceleration.step.n = {std::numeric_limits<double>::quiet_NaN()};
  carry_impulses(0, {0, 1}, contacts, acceleration);
  EXPECT_EQ(contacts.rn[0], 1.0);
  allocate(acceleration, Carry::momentum, contacts, {0, 0, 0});
  acceleration.steps.n = {std::numeric_limits<float>::quiet_NaN()};
  begin_steps({0, 1}, acceleration.steps);
  EXPECT_EQ(acceleration.steps.n[0], 0);
}

// Velocities made afresh lose what rounding had added to them. Momentum must not take that loss for motion:
// it would carry it on 9 times as large (beta = 0.9), and once more at the next refresh.
TEST(Momentum, TakesARefreshForNoMotion) {
  Contacts contacts;
  std::vector<Velocity> velocity(1);
  const std::vector<Slot> slots = {0};
  AccelerationHistory acceleration;
  allocate(acceleration, Carry::momentum, contacts, {1, 1, 0});
  WallCopy wall;
  velocity[0].u[0] = wall.velocity[0] = 1 + 1e-3;  // drifted from 1
  velocity[0].inv_mass = 0.3;
  carry_velocities(kernels, Carry::momentum, 0, slots, velocity, acceleration);
  carry_wall(Carry::momentum, 0, 0, wall, acceleration);
  loosen(slots, velocity, acceleration.last_v);
  loosen(0, wall, acceleration);
  velocity[0].u[0] = wall.velocity[0] = 1;  // made afresh
  fasten(slots, velocity, acceleration.last_v);
  fasten(0, wall, acceleration);
  carry_velocities(kernels, Carry::momentum, 0.9, slots, velocity, acceleration);
  carry_wall(Carry::momentum, 0.9, 0, wall, acceleration);
  EXPECT_NEAR(velocity[0].u[0], 1, 1e-15);
  EXPECT_NEAR(wall.velocity[0], 1, 1e-15);
  EXPECT_EQ(velocity[0].inv_mass, 0.3);
}

TEST(Momentum, OfBodiesIsTheSameToTheBitOnEveryInstructionSet) {
  if (best_instruction_set() == InstructionSet::portable) GTEST_SKIP() << test::no_other_instruction_set;
  for (const InstructionSet set : {InstructionSet::avx2, InstructionSet::avx512}) {
    if (set > best_instruction_set()) continue;
    std::vector<Velocity> velocity[2], last[2];
    const std::vector<Slot> slots = {3, 0, 2};
    for (const int k : {0, 1}) {
      velocity[k].resize(4);
      last[k].resize(4);
      for (std::size_t s = 0; s < 4; ++s)
        for (std::size_t c = 0; c < 3; ++c) {
          velocity[k][s].u[c] = 1 / (1.0 + static_cast<double>(4 * s + c));
          last[k][s].w[c] = 1 / (3.0 + static_cast<double>((4 * s + c) * (4 * s + c)));
          velocity[k][s].inv_mass = last[k][s].inv_mass = 0.7;
        }
      const SweepKernels those(k == 0 ? InstructionSet::portable : set);
      those.advance(slots, velocity[k], last[k], 0.9);
    }
    for (std::size_t s = 0; s < 4; ++s)
      for (std::size_t c = 0; c < 3; ++c) {
        EXPECT_EQ(velocity[0][s].u[c], velocity[1][s].u[c]);
        EXPECT_EQ(velocity[0][s].w[c], velocity[1][s].w[c]);
        EXPECT_EQ(last[0][s].u[c], last[1][s].u[c]);
        EXPECT_EQ(velocity[1][s].inv_mass, 0.7);
      }
  }
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
  stage.laws = laws_of_one_material(friction, friction, 0);
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
    ASSERT_TRUE(other.report.converged) << method.name();
    EXPECT_LT(other.report.iterations, plain.report.iterations) << method.name();
    for (std::size_t s = 0; s < plain.velocity.size(); ++s)
      for (int k = 0; k < 3; ++k)
        ASSERT_NEAR(other.velocity[s].u[k], plain.velocity[s].u[k], 1e-8) << method.name();
  }
}

// What carries impulses on must carry velocities, walls and glued copies on alike: the check makes V afresh
// from r, and would see the difference.
TEST(Methods, ReachTheToleranceWithFrictionOnSubdomains) {
  for (SolverMethod method : {SolverMethod::automatic, SolverMethod::momentum, SolverMethod::nncg})
    for (int subdomains : {1, 2, 8}) {
      const Solved solved = solve(method, 0.3, 1e-4, subdomains);
      EXPECT_TRUE(solved.report.converged) << method.name() << " on " << subdomains;
    }
}

// The choice is made when the step begins; then it is the method itself.
TEST(Methods, AutoTakesMomentum) {
  EXPECT_EQ(solve(SolverMethod::automatic, 0.3, 1e-4).digest,
            solve(SolverMethod::momentum, 0.3, 1e-4).digest);
}

TEST(Methods, GiveTheSameBitsOnAnyNumberOfThreads) {
  for (SolverMethod method : {SolverMethod::nlgs, SolverMethod::momentum, SolverMethod::nncg})
    EXPECT_EQ(solve(method, 0.3, 1e-4, 4, 1).digest, solve(method, 0.3, 1e-4, 4, 3).digest) << method.name();
}

}  // namespace
}  // namespace talus
