// Clusters that have no answer, and such as look like it: closed forms, and random walls around one grain.

#include "kernels/clusters/admissible.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "kernels/clusters/cluster_solver.hpp"
#include "tests/unit/kernels/clusters/cluster_makers.hpp"

namespace talus::admissible_test {
namespace {

using namespace cluster_makers;

bool none(const BodyProblem& problem) {
  double work = 1e9;
  return none_admissible(problem, enough, {}, work);
}

/// The wall of the last contact moves against the grain [m/s].
void close(BodyProblem& problem, double speed) {
  problem.contacts.back().offset = -speed * problem.contacts.back().normal;
}

/// Grains in a row along x, each the width of a grain from the next and the odd ones `aside` of it [rad],
/// between walls that close by `speed`.
BodyProblem row(int grains, double aside, double speed, double mu) {
  BodyProblem problem;
  for (int k = 0; k < grains; ++k) {
    add_grain(problem, Vec3::Zero(), mu);
    problem.bodies.back().free.u = Vec3::Zero();
    const double slope = k % 2 == 0 ? -aside : aside;
    if (k > 0) add_contact(problem, k, k - 1, Vec3(std::cos(slope), 0, -std::sin(slope)), mu);
  }
  add_contact(problem, 0, -1, Vec3::UnitX(), mu, 0);
  close(problem, speed);
  add_contact(problem, grains - 1, -1, -Vec3::UnitX(), mu, 1);
  close(problem, speed);
  return problem;
}

TEST(Admissible, NothingKeepsAStraightRowFromWallsThatClose) {
  for (const double mu : {0.0, 0.5})
    for (const int grains : {1, 2, 20, 100}) EXPECT_TRUE(none(row(grains, 0, 1, mu))) << grains << ' ' << mu;
}

/// It gives way sideways at 1/angle times the speed.
TEST(Admissible, ARowThatIsNearlyStraightGivesWay) {
  for (const double aside : {0.1, 1e-2, 1e-3})
    for (const int grains : {2, 3, 20})
      EXPECT_FALSE(none(row(grains, aside, 1, 0))) << grains << ' ' << aside;
}

TEST(Admissible, WallsThatOpenOrStandAskForNothing) {
  EXPECT_FALSE(none(row(20, 0, 0, 0)));
  EXPECT_FALSE(none(row(20, 0, -1, 0)));
  EXPECT_FALSE(none({}));
}

/// By what need not be told apart a solution may be wrong anyway.
TEST(Admissible, WallsThatCloseByRoundingOnlyAreNoJam) {
  for (const double speed : {1e-160, 1e-12, 0.1 * enough}) EXPECT_FALSE(none(row(1, 0, speed, 0.5))) << speed;
  EXPECT_TRUE(none(row(1, 0, 10 * enough, 0.5)));
}

/// Gravity presses a grain on a floor, and walls at its sides close by a trifle: it slides to rest as ever.
TEST(Admissible, ATrifleDoesNotTakeAnAnswerAway) {
  for (const double closing : {1e-12, 1e-9}) {
    BodyProblem problem = row(1, 0, closing, 0.5);
    problem.bodies[0].free.u = Vec3(0.3, 0, -1);
    add_contact(problem, 0, -1, Vec3::UnitZ(), 0.5, 2);
    const ClusterAnswer answer = solve_cluster(problem, {.enough = 1e-4, .relative = 1e-3, .sweeps = 100});
    EXPECT_EQ(answer.state, AnswerState::found) << closing;
  }
}

TEST(Admissible, AGrainLeavesAWedgeThatCloses) {
  for (const double a : {0.5, 1e-2, 1e-3}) {
    BodyProblem problem = wedge(a, 0.5);
    close(problem, 1);
    EXPECT_FALSE(none(problem)) << a;
  }
}

/// A wall that can be pushed away can be waited for, however heavy.
TEST(Admissible, AWallOfFiniteMassIsPushedAway) {
  for (const double mass : {1e-3, 1e3, 1e6}) {
    BodyProblem problem;
    add_grain(problem, Vec3::Zero(), 0);
    BodyUnknown lid;
    lid.mass = mass;
    lid.kind = BodyKind::wall;
    lid.axis = Vec3::UnitX();
    lid.free.u = -Vec3::UnitX();
    problem.bodies.push_back(lid);
    add_contact(problem, 0, -1, Vec3::UnitX(), 0, 0);
    add_contact(problem, 0, 1, -Vec3::UnitX(), 0, 1);
    EXPECT_FALSE(none(problem)) << mass;
  }
}

/// One grain among walls with random normals. With biases that a velocity of the grain satisfies it never
/// says that there is none; with normals n of which positive parts a add up to nothing, and sum a b < 0,
/// there is none (Farkas), and it says so, but where three of the normals all but balance.
TEST(Admissible, TellsRandomWallsApartThatLeaveARoomFromThoseThatLeaveNone) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  int told = 0;
  const auto vector = [&] { return Vec3(normal(random), normal(random), normal(random)); };
  for (int trial = 0; trial < 200; ++trial) {
    BodyProblem free, jammed;
    add_grain(free, Vec3::Zero(), 0.3);
    add_grain(jammed, Vec3::Zero(), 0.3);
    const Vec3 escape = vector();
    Vec3 sum = Vec3::Zero();
    for (int wall = 0; wall < 4; ++wall) {
      const Vec3 n = wall < 3 ? vector() : Vec3(-sum);
      sum += n;
      add_contact(free, 0, -1, n.normalized(), 0.3, wall);
      close(free, escape.dot(n.normalized()) - (wall == 0 ? 0.0 : 0.1));
      add_contact(jammed, 0, -1, n.normalized(), 0.3, wall);
      // a = |n|: biases of opposite signs, whose sum a b is -1.
      close(jammed, (wall == 0 ? 2 : wall == 1 ? -1 : 0) / n.norm());
    }
    EXPECT_FALSE(none(free)) << trial;
    if (none(jammed)) ++told;
  }
  EXPECT_GE(told, 190);
}

TEST(Admissible, AClusterWithoutAnAnswerIsNotSolvedAndSaidToBeJammed) {
  const BodyProblem problem = row(20, 0, 1, 0.5);
  const ClusterAnswer answer = solve_cluster(problem, {.enough = 1e-3, .relative = 1e-3, .sweeps = 100});
  EXPECT_EQ(answer.state, AnswerState::jammed);
}

/// A grain that a wedge of half angle a squeezes out parts from walls that it slides along if tan a > mu, and
/// turning does not help: the angle of nip of a roll crusher.
TEST(Admissible, AWedgeHoldsWhatItNipsBelowTheAngleOfFriction) {
  for (const double mu : {0.1, 0.3, 0.7})
    for (const double over : {0.9, 0.99, 1.01, 1.1}) {
      BodyProblem problem = wedge(std::atan(over * mu), mu);
      close(problem, 0.01);
      EXPECT_FALSE(none(problem)) << "without friction it gets away";
      double work = 1e9;
      EXPECT_EQ(friction_may_lock(problem, enough, {}, work), over < 1) << mu << ' ' << over;
      const ClusterAnswer answer = solve_cluster(problem, {.enough = 1e-4, .relative = 1e-3, .sweeps = 100});
      EXPECT_EQ(answer.state, over > 1 ? AnswerState::found : AnswerState::locked) << mu << ' ' << over;
    }
}

/// A grain that does not turn, between a floor and a lid that slides by, has an answer: it slides at one of
/// them. So has one on a belt that a weight presses.
TEST(Admissible, WhatSlidesByLocksNothing) {
  BodyProblem problem;
  add_grain(problem, Vec3::Zero(), 0.5);
  add_contact(problem, 0, -1, Vec3::UnitZ(), 0.5, 0);
  add_contact(problem, 0, -1, -Vec3::UnitZ(), 0.5, 1);
  problem.contacts[1].offset = 0.3 * Vec3::UnitX();
  for (const double weight : {0.0, 1.0}) {
    problem.bodies[0].free.u = -weight * Vec3::UnitZ();
    double work = 1e9;
    EXPECT_FALSE(friction_may_lock(problem, enough, {}, work)) << weight;
  }
}

TEST(Admissible, KeepsToItsWork) {
  double work = 1;
  EXPECT_FALSE(none_admissible(row(100, 0, 1, 0), enough, {}, work));
  EXPECT_LE(work, 0);
}

}  // namespace
}  // namespace talus::admissible_test
