#include "kernels/global/admm.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "kernels/global/balance.hpp"
#include "runtime/step/simulation.hpp"
#include "tests/unit/dense_sample.hpp"

namespace talus {
namespace {

constexpr double gravity = 9.81;

/// Units of mass, length and time against SI: answers have to scale.
struct Units {
  double mass = 1, length = 1, time = 1;
};

/// One sphere on the other on a floor; mass 1 each and `top` at the top, h = 1 ms.
BodyProblem column_problem(int grains, double mu, double top = 1, Units units = {}) {
  BodyProblem problem;
  for (int k = 0; k < grains; ++k) {
    BodyUnknown body;
    body.mass = units.mass * (k + 1 == grains ? top : 1);
    body.spin_mass = mu > 0 ? 0.4 * body.mass : 0;
    body.radius = 0.01 * units.length;
    body.x = Vec3(0, 0, (2 * k + 1) * body.radius);
    body.free.u = Vec3(0, 0, -gravity * 1e-3) * units.length / units.time;
    problem.bodies.push_back(body);
    ContactEquation contact;
    contact.normal = Vec3::UnitZ();
    contact.offset = Vec3::Zero();
    contact.mu = mu;
    contact.first = k;
    contact.second = k - 1;
    problem.contacts.push_back(contact);
  }
  problem.grains = problem.bodies.size();
  problem.impulse.assign(problem.contacts.size(), Vec3::Zero());
  return problem;
}

/// Largest error of an impulse against the weight above, over the whole weight.
double column_error(const BodyProblem& problem) {
  double error = 0, due = 0;
  for (std::size_t k = problem.contacts.size(); k-- > 0;) {
    due -= problem.bodies[k].mass * problem.bodies[k].free.u[2];
    error = std::max(error, (problem.impulse[k] - due * Vec3::UnitZ()).norm());
  }
  return error / due;
}

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

/// kappa from impulses that carry the load: sum W_nn r^2 / |M^-1/2 H r|^2.
double stiffness_of(const BodyProblem& problem, std::span<const Vec3> impulse) {
  std::vector<Twist> gained = velocities_of(problem, impulse);
  double kinetic = 0;
  for (std::size_t b = 0; b < gained.size(); ++b) {
    const BodyUnknown& body = problem.bodies[b];
    kinetic += body.mass * (gained[b].u - body.free.u).squaredNorm() +
               body.spin_mass * (gained[b].w - body.free.w).squaredNorm();
  }
  double sum = 0;
  for (std::size_t k = 0; k < impulse.size(); ++k)
    sum += impulse[k].squaredNorm() / effective_mass(problem, problem.contacts[k]);
  return kinetic > 0 ? sum / kinetic : 0;
}

TEST(Stiffness, IsThatOfTheForcesThatCarryTheLoad) {
  for (const double top : {1.0, 1e4}) {
    BodyProblem column = column_problem(60, 0.35, top);
    const double before = estimate_stiffness(column);
    if (top == 1) {
      EXPECT_NEAR(before, 2 * 60 * 60 / 3.0, 0.05 * before);  // effective masses of 1/2
    }
    solve_admm(column, {.tolerance = 1e-8, .balance_tolerance = 0});
    EXPECT_NEAR(stiffness_of(column, column.impulse), before, 0.01 * before);
  }
}

/// Boulders of `heavy` times the mass of a pebble between them, in the void.
BodyProblem pebble_between_boulders(double heavy) {
  BodyProblem problem = column_problem(3, 0, heavy);
  problem.contacts.erase(problem.contacts.begin());
  problem.impulse.resize(2);
  problem.bodies[0].mass = heavy;
  problem.bodies[0].free.u = Vec3(0, 0, 1);
  problem.bodies[1].free.u = Vec3::Zero();
  problem.bodies[2].free.u = Vec3(0, 0, -1);
  return problem;
}

/// The load of a boulder goes through the pebble, whatever else there is that hangs together with neither.
TEST(Stiffness, OfASmallClusterIsSeenBesideWhatItDoesNotTouch) {
  constexpr double heavy = 1e6;
  const BodyProblem alone = pebble_between_boulders(heavy);
  const double expected = estimate_stiffness(alone);
  EXPECT_GT(expected, 0.1 * heavy);
  BodyProblem beside = alone;  // a heavier body that touches nothing
  beside.bodies.push_back(alone.bodies[0]);
  beside.bodies.back().mass *= 2;
  beside.grains = beside.bodies.size();
  EXPECT_EQ(estimate_stiffness(beside), expected);
  BodyProblem floor = alone;  // a grain at rest on a floor
  floor.bodies.push_back(alone.bodies[1]);
  floor.grains = floor.bodies.size();
  ContactEquation contact = alone.contacts[0];
  contact.first = 3;
  contact.second = -1;
  floor.contacts.push_back(contact);
  floor.impulse.push_back(Vec3::Zero());
  EXPECT_GT(estimate_stiffness(floor), 0.1 * heavy);
}

/// What is not finite must never pass for solved, whichever body it comes from.
TEST(Admm, DoesNotCallNaNSolved) {
  for (const std::size_t body : {0, 29}) {
    BodyProblem problem = column_problem(30, 0.35, 100);
    problem.bodies[body].free.u[2] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_FALSE(solve_admm(problem, {}).converged) << body;
  }
}

// ---- the error of all velocities

/// All of a long column sinks alike: of its contacts only the lowest shows it.
TEST(VelocityError, SeesAColumnSinkThroughItsLowestContact) {
  for (const double mu : {0.35, 0.0})
    for (const double top : {1.0, 1e6}) {
      BodyProblem column = column_problem(300, mu, top);
      double due = 0;
      for (std::size_t k = column.contacts.size(); k-- > 0;) {
        due -= column.bodies[k].mass * column.bodies[k].free.u[2];
        column.impulse[k] = Vec3(0, 0, 0.9 * due);
      }
      EXPECT_NEAR(velocity_error(column, 1e-3).relative, 0.1 / 0.9, 0.02) << "mu " << mu << ", top " << top;
    }
}

TEST(VelocityError, IsSmallWhereTheLawHolds) {
  BodyProblem rests = column_problem(30, 0.35), slides = column_problem(1, 0.3);
  slides.bodies[0].free.u = Vec3(1, 0, -0.1);
  for (BodyProblem* problem : {&rests, &slides}) {
    EXPECT_TRUE(solve_admm(*problem, {.tolerance = 1e-9, .balance_tolerance = 0}).converged);
    EXPECT_LT(velocity_error(*problem, 1e-6).relative, 1e-5);
  }
}

/// What light grains lack counts with their mass, however heavy the body at rest beside them.
TEST(VelocityError, OfLightGrainsCountsWithTheirMass) {
  constexpr int grains = 1000;
  constexpr double heavy = 1e7;
  BodyProblem problem = column_problem(grains, 0.35);
  double due = 0;
  for (std::size_t k = problem.contacts.size(); k-- > 0;) {
    due -= problem.bodies[k].mass * problem.bodies[k].free.u[2];
    problem.impulse[k] = Vec3(0, 0, 0.9 * due);
  }
  BodyUnknown rock = problem.bodies[0];
  rock.mass *= heavy;
  rock.spin_mass *= heavy;
  ContactEquation floor = problem.contacts[0];
  floor.first = static_cast<std::int32_t>(problem.bodies.size());
  problem.bodies.push_back(rock);
  problem.grains = problem.bodies.size();
  problem.contacts.push_back(floor);
  problem.impulse.push_back(-rock.mass * rock.free.u);
  const double relative = 0.1 * grains / heavy;
  EXPECT_NEAR(velocity_error(problem, 0.1 * relative).relative, relative, 0.5 * relative);
}

/// Two grains sink at 1 m/s under one that follows at 1/2 m/s and a hundred times their mass: stopped, they
/// stop it too, though its contact is open. So far contacts changed the first two by 1 m/s each.
TEST(VelocityError, CountsWhatAnOpenContactMeetsOnTheWay) {
  BodyProblem column = column_problem(3, 0, 100);
  column.bodies[0].free.u[2] = column.bodies[1].free.u[2] = -2;
  column.bodies[2].free.u[2] = -0.5;
  column.impulse[0] = Vec3(0, 0, 2);
  column.impulse[1] = Vec3(0, 0, 1);
  EXPECT_NEAR(velocity_error(column, 1e-3).relative, (1 + 1 + 100 * 0.5) / (1 + 1), 1);
}

/// A ball that lands on the floor, or leaves it, is no drive: it hides nothing of what the column lacks.
TEST(VelocityError, OfAColumnIsSeenBesideABallThatLandsOnTheSameFloor) {
  for (const double bias : {0.45, -0.25}) {  // a gap to close, a rebound [m/s]
    BodyProblem problem = column_problem(60, 0.35);
    double due = 0;
    for (std::size_t k = problem.contacts.size(); k-- > 0;) {
      due -= problem.bodies[k].mass * problem.bodies[k].free.u[2];
      problem.impulse[k] = Vec3(0, 0, 0.5 * due);
    }
    BodyUnknown ball = problem.bodies[0];
    ball.free.u = Vec3(0, 0, -0.5);
    ContactEquation landing = problem.contacts[0];
    landing.first = static_cast<std::int32_t>(problem.bodies.size());
    landing.offset = bias * landing.normal;
    problem.bodies.push_back(ball);
    problem.grains = problem.bodies.size();
    problem.contacts.push_back(landing);
    problem.impulse.push_back(Vec3(0, 0, 0.5 - bias));
    EXPECT_GT(velocity_error(problem, 1e-3).relative, 0.2) << bias;
  }
}

/// Two grains that fly side by side, a rounding apart: there is nothing to solve, and nothing is missing.
TEST(VelocityError, IsNoneWhereOnlyRoundingIsLeft) {
  BodyProblem pair = column_problem(2, 0.35);
  pair.contacts.erase(pair.contacts.begin());
  pair.impulse.resize(1);
  pair.bodies[0].free.u = Vec3(-1.0 / 3, 0, 0);
  for (const double apart : {0.0, 1e-17, -1e-17, 5e-17}) {
    pair.bodies[1].free.u = Vec3(-1.0 / 3, 0, apart);
    EXPECT_LT(velocity_error(pair, 1e-3).relative, 1e-3) << apart;
  }
}

/// Nothing moves, but an overlap asks to be opened.
TEST(VelocityError, IsNoneOnlyWhereNothingIsAskedFor) {
  BodyProblem pair = column_problem(2, 0.35);
  pair.contacts.erase(pair.contacts.begin());
  pair.impulse.resize(1);
  for (BodyUnknown& body : pair.bodies) body.free.u = Vec3::Zero();
  EXPECT_EQ(velocity_error(pair, 1e-3).relative, 0);
  pair.contacts[0].offset = Vec3(0, 0, -1e-3);
  EXPECT_GT(velocity_error(pair, 1e-3).relative, 1);
}

TEST(VelocityError, ScalesWithTheUnits) {
  const Units units{.mass = 1e6, .length = 1e-6, .time = 1e3};
  BodyProblem plain = column_problem(30, 0.35), scaled = column_problem(30, 0.35, 1, units);
  for (BodyProblem* problem : {&plain, &scaled})
    solve_admm(*problem, {.tolerance = 1e-2, .balance_tolerance = 0});
  const double error = velocity_error(plain, 1e-4).relative;
  EXPECT_GT(error, 0);
  EXPECT_NEAR(velocity_error(scaled, 1e-4).relative, error, 1e-6 * error);
}

/// A driven wall pushes a grain into the floor: whatever the impulses, no velocity will do.
TEST(VelocityError, StaysLargeWhereThereIsNoAnswer) {
  BodyProblem crushed = column_problem(1, 0.35);
  ContactEquation lid = crushed.contacts[0];
  lid.normal = -Vec3::UnitZ();
  lid.offset = Vec3(0, 0, 0.1);  // v_n = -u_z - 0.1: it comes down at 0.1 m/s
  lid.drive = 0.1;
  crushed.contacts.push_back(lid);
  for (const double free : {-0.01, -0.05})  // half-way the walls' wishes cancel, and no motion is asked for
    for (const double pressed : {1.0, 1e3, 1e6}) {
      crushed.bodies[0].free.u[2] = free;
      crushed.impulse = {Vec3(0, 0, pressed), Vec3(0, 0, -pressed)};
      EXPECT_GT(velocity_error(crushed, 1e-3).relative, 0.3) << pressed << " at " << free;
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
