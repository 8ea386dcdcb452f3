#include "kernels/global/balance.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "kernels/global/admm.hpp"
#include "kernels/global/stiffness.hpp"
#include "tests/unit/kernels/global/column_problem.hpp"

namespace talus::balance_test {
namespace {

using test::column_problem;
using test::gravity;
using test::Units;

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

}  // namespace
}  // namespace talus::balance_test
