#include "kernels/global/admm.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "kernels/global/balance.hpp"
#include "runtime/step/simulation.hpp"
#include "tests/unit/dense_sample.hpp"
#include "tests/unit/kernels/global/column_problem.hpp"

namespace talus {
namespace {

using test::column_error;
using test::column_problem;
using test::gravity;
using test::Units;

TEST(Admm, CarriesTheWeightOfALongColumn) {
  for (const double mu : {0.35, 0.0})
    for (const double top : {1.0, 1e6}) {
      BodyProblem rough = column_problem(100, mu, top), fine = rough;
      EXPECT_TRUE(solve_admm(rough, {}).converged);
      EXPECT_LT(column_error(rough), 1e-3) << "mu " << mu << ", top " << top;
      const BodyAdmmResult result = solve_admm(fine, {.tolerance = 1e-5, .balance_tolerance = 1e-7});
      EXPECT_LT(column_error(fine), 1e-6) << "mu " << mu << ", top " << top;
      EXPECT_LT(result.iterations, 100);
    }
}

TEST(Admm, StartsFromTheImpulsesThatItIsGiven) {
  BodyProblem problem = column_problem(100, 0.35);
  const int cold = solve_admm(problem, {.tolerance = 1e-8, .balance_tolerance = 0}).iterations;
  const int warm = solve_admm(problem, {.tolerance = 1e-6, .balance_tolerance = 0}).iterations;
  EXPECT_LT(3 * warm, cold);
  EXPECT_LT(column_error(problem), 1e-6);
}

TEST(Admm, ScalesWithTheUnits) {
  BodyProblem plain = column_problem(30, 0.35, 100);
  const BodyAdmmResult expected = solve_admm(plain, {});
  // Powers of two scale without rounding: the same bits.
  for (const Units& units : {Units{0x1p20, 1, 1}, Units{0x1p-20, 1, 1}, Units{1, 0x1p20, 1},
                             Units{1, 0x1p-20, 1}, Units{1, 1, 0x1p20}, Units{0x1p-20, 0x1p20, 0x1p-20}}) {
    BodyProblem scaled = column_problem(30, 0.35, 100, units);
    EXPECT_EQ(solve_admm(scaled, {}).iterations, expected.iterations);
    const double unit = units.mass * units.length / units.time;
    for (std::size_t k = 0; k < plain.impulse.size(); ++k)
      EXPECT_NEAR(scaled.impulse[k][2] / unit, plain.impulse[k][2], 1e-9 * plain.impulse[0][2]);
  }
}

TEST(Admm, HasNothingToDoWithoutContacts) {
  BodyProblem problem = column_problem(3, 0.35);
  problem.contacts.clear();
  problem.impulse.clear();
  const BodyAdmmResult result = solve_admm(problem, {});
  EXPECT_TRUE(result.converged);
  EXPECT_EQ(result.iterations, 0);
  BodyProblem empty;
  EXPECT_TRUE(solve_admm(empty, {}).converged);
}

TEST(Admm, PutsOneBodyOnTheFloor) {
  BodyProblem problem = column_problem(1, 0.35);
  EXPECT_TRUE(solve_admm(problem, {}).converged);
  EXPECT_LT(column_error(problem), 1e-3);
}

/// Two spheres in the void, the second `ratio` times as heavy, approach head-on at 1 m/s: afterwards they
/// move on together.
TEST(Admm, KeepsMomentumOfAFloatingPair) {
  for (const double ratio : {1.0, 1e6}) {
    BodyProblem problem = column_problem(2, 0.35, ratio);
    problem.contacts.erase(problem.contacts.begin());
    problem.impulse.resize(1);
    problem.bodies[0].free.u = Vec3(0, 0, 1);
    problem.bodies[1].free.u = Vec3::Zero();
    EXPECT_TRUE(solve_admm(problem, {.tolerance = 1e-9, .balance_tolerance = 0}).converged);
    const std::vector<Twist> V = velocities_of(problem, problem.impulse);
    EXPECT_NEAR(V[0].u[2], 1 / (1 + ratio), 1e-6);
    EXPECT_NEAR(V[0].u[2] + ratio * V[1].u[2], 1, 1e-6 * ratio);
  }
}

TEST(Admm, SlidesAtTheCoulombLimit) {
  BodyProblem problem = column_problem(1, 0.3);
  problem.bodies[0].spin_mass = 0;
  problem.bodies[0].free.u = Vec3(1, 0, -0.1);
  EXPECT_TRUE(solve_admm(problem, {.tolerance = 1e-9, .balance_tolerance = 0}).converged);
  EXPECT_NEAR(problem.impulse[0][2], 0.1, 1e-7);
  EXPECT_NEAR(problem.impulse[0][0], -0.03, 1e-7);
}

TEST(Admm, DoesNotHoldWhatHasNoFriction) {
  BodyProblem problem = column_problem(1, 0);
  problem.bodies[0].free.u = Vec3(1, 0, -0.1);
  EXPECT_TRUE(solve_admm(problem, {.tolerance = 1e-9, .balance_tolerance = 0}).converged);
  EXPECT_LT((problem.impulse[0] - Vec3(0, 0, 0.1)).norm(), 1e-7);
}

TEST(Admm, DoesNotPullOnWhatOpens) {
  BodyProblem problem = column_problem(2, 0.35);
  problem.bodies[1].free.u = Vec3(0, 0, 1);
  EXPECT_TRUE(solve_admm(problem, {.tolerance = 1e-7, .balance_tolerance = 0}).converged);
  EXPECT_EQ(problem.impulse[1], Vec3::Zero());
  EXPECT_NEAR(problem.impulse[0][2], gravity * 1e-3, 1e-8);
}

/// What is not finite must never pass for solved, whichever body it comes from.
TEST(Admm, DoesNotCallNaNSolved) {
  for (const std::size_t body : {0, 29}) {
    BodyProblem problem = column_problem(30, 0.35, 100);
    problem.bodies[body].free.u[2] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_FALSE(solve_admm(problem, {}).converged) << body;
  }
}

// ---- whole steps

/// A block of touching spheres, `edge` x `edge` x `layers`, on a floor, under a plate of `plate` grain
/// masses.
struct PlateOutcome {
  double velocity = 0;  ///< over g h
  double force = 0;     ///< over the weight of the plate
  StepReport report;
  IterationResult iterations;
  int sweeps_since = 0;  ///< the last call of ADMM: two checks without a sweep between them
  std::uint64_t digest = 0;
};

struct Block {
  int edge = 5, layers = 20;
  double gap = 0;  ///< under the plate [m]
  int steps = 1;
};

PlateOutcome plate_on_block(SolverMethod method, double plate, int subdomains = 1, int threads = 1,
                            Coupling coupling = Coupling::nscdd, Block block = {}) {
  constexpr double radius = 0.01, h = 1e-3;
  const int edge = block.edge, layers = block.layers;
  Bodies bodies;
  for (int k = 0; k < edge * edge * layers; ++k)
    add_sphere(bodies, BodyId{k},
               radius * Vec3(2 * (k % edge) + 1, 2 * (k / edge % edge) + 1, 2 * (k / (edge * edge)) + 1),
               radius * (1 + 1e-9), 2600);
  talus::Setup setup;
  Wall floor, lid;
  floor.name = "floor";
  lid.name = "plate";
  lid.normal = -Vec3::UnitZ();
  lid.point = Vec3(0, 0, 2 * radius * layers + block.gap);
  lid.load.drive = WallDrive::force;
  lid.load.mass = plate * bodies.mass(0);
  lid.load.force = lid.load.mass * gravity;
  setup.walls = {floor, lid};
  Stage stage;
  stage.name = "rest";
  stage.time_step = h;
  stage.gravity = Vec3(0, 0, -gravity);
  stage.laws = laws_of_one_material(0.35, 0.35, 0);
  stage.end.steps = block.steps;
  setup.stages = {stage};
  setup.solver.method = method;
  setup.solver.max_iterations = 2000;
  setup.solver.balance_tolerance = 0.01;
  setup.decomposition.subdomains = subdomains;
  setup.decomposition.coupling = coupling;
  graph::Executor executor({.threads = threads});
  Simulation simulation(setup, std::move(bodies), executor);
  PlateOutcome outcome;
  for (int k = 0; k < block.steps; ++k) outcome.report = simulation.step();
  outcome.iterations = simulation.iterations();
  const auto& checks = simulation.error_history();
  for (std::size_t k = 1; k < checks.size(); ++k)
    if (checks[k].iterations == checks[k - 1].iterations)
      outcome.sweeps_since = outcome.report.iterations - checks[k].iterations;
  outcome.velocity = std::abs(simulation.walls()[1].velocity) / (gravity * h);
  outcome.force = simulation.walls()[1].force.norm() / lid.load.force;
  outcome.digest = simulation.digest();
  return outcome;
}

TEST(Balance, CatchesThePlateThatSweepsLeaveFalling) {
  const PlateOutcome plain = plate_on_block(SolverMethod::nlgs, 1e6);
  EXPECT_GT(plain.velocity, 0.5) << "the scene is to be too stiff for sweeps";
  EXPECT_LT(plain.report.error_rms, 1e-2) << "each contact looks nearly satisfied";
  EXPECT_FALSE(plain.report.converged);
  EXPECT_GT(2 * plain.report.balance, std::abs(1 - plain.force));
}

TEST(Balance, WeighsDriftByTheSweepsThatTheProblemNeeds) {
  EXPECT_EQ(unbalance(0.01, 100, 100), 0.01) << "sweeps see through";
  EXPECT_EQ(unbalance(0.01, 1000, 1e5), 2);
  EXPECT_EQ(unbalance(0.01, 1000000, 1e5), 0.01);
}

TEST(AdmmStep, BringsAHeavyPlateToRest) {
  for (const SolverMethod method : {SolverMethod::admm, SolverMethod::automatic})
    for (const int subdomains : {1, 5, 12}) {
      const PlateOutcome outcome = plate_on_block(method, 1e6, subdomains);
      EXPECT_TRUE(outcome.report.converged) << subdomains;
      EXPECT_GE(outcome.iterations.stiff_calls, 1);
      EXPECT_GE(outcome.sweeps_since, 50) << "they mend what it has left of the grains";
      EXPECT_LT(outcome.velocity, 0.01) << subdomains;
      EXPECT_NEAR(outcome.force, 1, 0.01) << subdomains;
    }
}

// What was known of the problem before it landed says nothing of the one after, on the same candidates.
TEST(AdmmStep, IsCalledInTheStepInWhichAHeavyPlateLands) {
  Block block{.edge = 12, .layers = 8, .gap = 1.9e-5, .steps = 1};  // two steps' fall are 2.9e-5 m
  const PlateOutcome before = plate_on_block(SolverMethod::automatic, 1e6, 1, 1, Coupling::nscdd, block);
  EXPECT_EQ(before.iterations.stiff_calls, 0);
  EXPECT_EQ(before.force, 0);
  block.steps = 2;
  const PlateOutcome landed = plate_on_block(SolverMethod::automatic, 1e6, 1, 1, Coupling::nscdd, block);
  EXPECT_GE(landed.iterations.stiff_calls, 1);
  EXPECT_TRUE(landed.report.converged);
}

TEST(AdmmStep, NeedsNoMoreIterationsInSubdomains) {
  const int alone = plate_on_block(SolverMethod::admm, 1e6).iterations.stiff.iterations;
  for (const Coupling coupling : {Coupling::nscdd, Coupling::alternating, Coupling::schwarz})
    for (const int subdomains : {4, 12}) {
      const PlateOutcome outcome = plate_on_block(SolverMethod::admm, 1e6, subdomains, 1, coupling);
      EXPECT_LE(outcome.iterations.stiff.iterations, 2 * alone);
      EXPECT_LT(outcome.velocity, 0.01);
      EXPECT_NEAR(outcome.force, 1, 0.01);
    }
}

TEST(AdmmStep, HasTheSameBitsWithAnyNumberOfThreads) {
  const PlateOutcome one = plate_on_block(SolverMethod::admm, 1e6, 4, 1);
  EXPECT_GE(one.iterations.stiff_calls, 1);
  for (const int threads : {2, 3})
    EXPECT_EQ(plate_on_block(SolverMethod::admm, 1e6, 4, threads).digest, one.digest);
}

TEST(AdmmStep, IsNotCalledWhereSweepsSeeThrough) {
  EXPECT_EQ(plate_on_block(SolverMethod::automatic, 1).iterations.stiff_calls, 0);
}

}  // namespace
}  // namespace talus
