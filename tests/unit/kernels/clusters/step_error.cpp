// The error of steps in small clusters of contacts, against closed forms, and the Newton step that mends it.

#include "kernels/clusters/step_error.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "kernels/clusters/clusters.hpp"
#include "tests/unit/kernels/clusters/cluster_makers.hpp"

namespace talus::step_error_test {
namespace {

using namespace cluster_makers;

/// One grain on the other on a floor, wall 0; impulses `part` of what they carry at rest.
void add_column(BodyProblem& problem, int grains, double x, double part) {
  std::int32_t below = -1;
  for (int k = 0; k < grains; ++k) {
    const std::int32_t grain = add_grain(problem, Vec3(x, 0, 0.02 * k + 0.01), 0);
    add_contact(problem, grain, below, Vec3::UnitZ(), 0, below < 0 ? 0 : -1);
    problem.impulse.back() = Vec3(0, 0, part * (grains - k) * fall);
    below = grain;
  }
}

TEST(StepError, OfAWedgeIsThatOfItsImpulsesHoweverSharpItIs) {
  for (const double a : {0.5, 1e-2, 1e-3})
    for (const double part : {0.0, 0.5, 0.9}) {
      BodyProblem problem = wedge(a, 0);
      for (std::size_t k = 0; k < 2; ++k)
        problem.impulse[k] = part * fall / (2 * std::sin(a)) * problem.contacts[k].normal;
      const StepError error = step_error(problem, {.enough = 1e-4});
      EXPECT_NEAR(error.wall, 1 - part, 1e-3) << a;
      EXPECT_NEAR(error.contact, 1 - part, 1e-3) << a;
      EXPECT_TRUE(error.mends);
      for (std::size_t k = 0; k < 2; ++k) problem.impulse[k] += error.change[0][k];
      EXPECT_NEAR(problem.impulse[0].norm(), fall / (2 * std::sin(a)), 1e-3 * fall / a) << a;
      EXPECT_LT(step_error(problem, {.enough = 1e-4}).relative(), 1e-3) << a;
    }
}

// A grain that friction holds between two walls: how hard they press it says nothing of how it moves.
TEST(StepError, OfAGrainThatIsJammedIsThatOfWhatHoldsIt) {
  constexpr double press = 1e5 * fall, part = 0.9;
  BodyProblem problem;
  const std::int32_t grain = add_grain(problem, Vec3::Zero(), 0.5);
  for (const int side : {-1, 1}) {
    add_contact(problem, grain, -1, side * Vec3::UnitX(), 0.5, side < 0 ? 0 : 1);
    problem.impulse.back() = Vec3(side * press, 0, part * fall / 2);
  }
  EXPECT_NEAR(step_error(problem, {.enough = 1e-4}).velocity, (1 - part) / part, 1e-3) << "over what they do";
  StepErrorThresholds coarse;
  coarse.pressed = 1e-2;  // of both walls
  EXPECT_NEAR(step_error(problem, {.enough = 1e-6}, coarse).velocity, (1 - part) * fall / (1e-2 * 2 * press),
              1e-8);
}

// Velocities are compared with the speed of a driven wall, forces with forces: a grain on a drum was
// certified with 4.5 times its claim.
TEST(StepError, OfAForceOnAFastWallIsFound) {
  constexpr double off = 0.01, fast = 1e3;
  for (const int grains : {1, 2}) {
    BodyProblem problem;
    add_column(problem, grains, 0, 1 - off);
    problem.contacts[0].drive = fast * fall;
    const StepError error = step_error(problem, {.enough = 1e-3});
    EXPECT_NEAR(error.contact, off, 1e-3 * off) << grains;
    EXPECT_NEAR(error.velocity, off / fast, 1e-3 * off) << grains;
  }
}

// A grain went on into a wall, beside others in a drum: a millionth of the drum's speed counted for it, too.
TEST(StepError, OfAColumnIsNotHiddenByAFastWallBesideIt) {
  BodyProblem problem;
  add_column(problem, 3, 0, 0.7);
  add_column(problem, 1, 1, 1);
  problem.contacts.back().drive = 1e9 * fall;
  EXPECT_NEAR(step_error(problem, {.enough = 1e-4}).velocity, 0.3 / 0.7, 1e-3);
}

TEST(StepError, OfAColumnIsNotHiddenByGrainsAtRestBesideIt) {
  BodyProblem problem;
  add_column(problem, 50, 0, 0.7);
  for (int k = 1; k <= 2000; ++k) add_column(problem, 1, k, 1);
  const StepError error = step_error(problem, {.enough = 1e-4});
  EXPECT_NEAR(error.velocity, 0.3 / 0.7, 1e-3) << "momentum missing, over what contacts have exchanged";
  EXPECT_NEAR(error.contact, 0.3, 1e-6);
}

// A ball that hit the floor at 5 m/s hid that a column beside it fell.
TEST(StepError, OfAColumnIsNotHiddenByAFarFasterGrainBesideIt) {
  BodyProblem problem;
  add_column(problem, 50, 0, 0.7);
  const std::int32_t grain = add_grain(problem, Vec3(9, 0, 0.01), 0);
  BodyUnknown& ball = problem.bodies[static_cast<std::size_t>(grain)];
  ball.free.u = Vec3(0, 0, -5000 * fall / ball.mass);
  ball.mass *= 1e6;
  add_contact(problem, grain, -1, Vec3::UnitZ(), 0, 0);
  problem.impulse.back() = -ball.mass * ball.free.u;
  const StepError error = step_error(problem, {.enough = 1e-4});
  EXPECT_NEAR(error.velocity, 0.3 / 0.7, 1e-2);
  EXPECT_NEAR(error.contact, 0.3, 1e-6);
}

/// The ball touches the column's top from the side, and the contact carries nothing.
TEST(StepError, OfAColumnIsNotHiddenByAFarFasterGrainThatItTouches) {
  for (const double part : {0.7, 1.0}) {
    BodyProblem problem;
    add_column(problem, 10, 0, part);
    const std::int32_t grain = add_grain(problem, Vec3(0.02, 0, 0.19), 0);
    problem.bodies.back().free.u = Vec3(0, 0, -5000 * fall);
    add_contact(problem, grain, -1, Vec3::UnitZ(), 0, 0);
    problem.impulse.back() = Vec3(0, 0, 5000 * fall);
    add_contact(problem, grain, 9, Vec3::UnitX(), 0);
    const StepError error = step_error(problem, {.enough = 1e-4});
    EXPECT_NEAR(error.velocity, (1 - part) / part, 1e-2);
    EXPECT_NEAR(error.contact, 1 - part, 1e-6);
    EXPECT_EQ(error.mends, part < 1);
  }
}

/// A step whose sweeps have not come far: the upper grains of the column fall as if alone.
TEST(StepError, OfAColumnThatForcesHaveYetToReachIsNotHiddenEither) {
  BodyProblem problem;
  add_column(problem, 60, 0, 1);
  for (std::size_t k = 10; k < 60; ++k) problem.impulse[k].setZero();
  for (std::size_t k = 0; k < 10; ++k) problem.impulse[k] = Vec3(0, 0, static_cast<double>(10 - k) * fall);
  const std::int32_t grain = add_grain(problem, Vec3(0.02, 0, 1.19), 0);
  problem.bodies.back().free.u = Vec3(0, 0, -5000 * fall);
  add_contact(problem, grain, -1, Vec3::UnitZ(), 0, 0);
  problem.impulse.back() = Vec3(0, 0, 5000 * fall);
  add_contact(problem, grain, 59, Vec3::UnitX(), 0);
  for (const int most_rounds : {1, 4, 100}) {
    StepErrorThresholds thresholds;
    thresholds.most_rounds = most_rounds;
    const StepError error = step_error(problem, {.enough = 1e-4}, thresholds);
    EXPECT_TRUE(error.mends) << most_rounds;
    EXPECT_GT(error.velocity, 1) << most_rounds;
    EXPECT_NEAR(error.contact, 50. / 60, 1e-6) << most_rounds;
    EXPECT_NEAR(error.change[0][0][2], 50 * fall, 1e-6) << most_rounds;
  }
}

/// Where the answer of one group runs into another, they have one answer together: a grain that lies loosely
/// on a column which comes up.
TEST(StepError, OfGroupsThatAreAboutToMeetIsThatOfAll) {
  BodyProblem problem;
  add_column(problem, 2, 0, 0);
  problem.bodies[0].free.u = Vec3(0, 0, 1);
  problem.bodies[1].free.u = Vec3(0, 0, 0);
  const StepError error = step_error(problem, {.enough = 1e-6});
  EXPECT_TRUE(error.mends);
  EXPECT_NEAR(error.change[0][1][2], 0.5, 1e-6);
  EXPECT_NEAR(error.change[0][0][2], 0, 1e-6);
  EXPECT_GT(error.velocity, 1) << "without an impulse nothing is exchanged";
}

/// Three grains in a row that fills a cell along x, which a pressure closes with `momentum`: impulses `part`
/// of what they carry.
BodyProblem row_in_a_cell(double momentum, double part) {
  BodyProblem problem;
  for (int k = 0; k < 3; ++k) {
    add_grain(problem, Vec3(0.02 * k, 0, 0), 0);
    problem.bodies.back().free.u = Vec3::Zero();
  }
  for (std::int32_t k = 0; k < 3; ++k) {
    add_contact(problem, (k + 1) % 3, k, Vec3::UnitX(), 0);
    problem.contacts.back().cell = 3;
    problem.contacts.back().branch = Vec3::UnitX();  // d is a diameter
    problem.impulse.back() = part * momentum / 3 * Vec3::UnitX();
  }
  BodyUnknown cell;
  cell.kind = BodyKind::cell;
  cell.mass = cell.spin_mass = 3;
  cell.radius = 3;  // its edge over d
  cell.axis = Vec3::Ones();
  cell.shears = Vec3(1, 0, 0);
  cell.free.u = Vec3(-momentum / cell.mass, 0, 0);
  problem.bodies.push_back(cell);
  return problem;
}

/// Its edge is three diameters.
const ErrorGoal in_cell{.enough = 1e-4, .faces = {1.0 / 3, 0, 0}};

TEST(StepError, OfACellUnderAStressIsThatOfWhatItsContactsCarry) {
  for (const double part : {0.0, 0.5, 0.9}) {
    BodyProblem problem = row_in_a_cell(0.6, part);
    const StepError error = step_error(problem, in_cell);
    EXPECT_NEAR(error.contact, 1 - part, 1e-6) << part;
    EXPECT_NEAR(error.wall, 1 - part, 1e-6) << "its face across x, " << part;
    if (part > 0) {
      EXPECT_NEAR(error.velocity, (1 - part) / part, 1e-6) << part;
    }
    for (std::size_t k = 0; k < 3; ++k) {
      problem.impulse[k] += error.change[0][k];
      EXPECT_NEAR(problem.impulse[k][0], 0.2, 1e-7) << part;
    }
    EXPECT_LT(step_error(problem, in_cell).relative(), 1e-6) << part;
  }
}

TEST(StepError, OfACellUnderAStressIsOneClusterThoughItsGrainsTouchInPairs) {
  BodyProblem problem = row_in_a_cell(0.6, 0);
  problem.contacts[1] = problem.contacts[0];
  problem.contacts[1].first = problem.contacts[1].second = 2;  // its own image
  problem.contacts.resize(2);
  problem.impulse.resize(2);
  const PartLink alone;
  const std::vector<ContactGraph> graphs{graph_of(problem)};
  const Clusters clusters = clusters_of(graphs, alone);
  EXPECT_EQ(clusters.of_body[0][0], clusters.of_body[0][2]);
  EXPECT_EQ(clusters.of_body[0][0], clusters.of_body[0][3]) << "the cell is one of it";
}

/// Two grains in a cell whose flow is given.
TEST(StepError, OfACellWhoseFlowIsGivenHasFaces) {
  BodyProblem problem;
  for (int k = 0; k < 2; ++k) {
    add_grain(problem, Vec3(0.02 * k, 0, 0), 0);
    problem.bodies.back().free.u = Vec3((0.5 - k) * 0.2, 0, 0);
  }
  add_contact(problem, 1, 0, Vec3::UnitX(), 0);
  problem.impulse.back() = 0.07 * Vec3::UnitX();  // of 0.1
  EXPECT_EQ(step_error(problem, {.enough = 1e-4}).wall, 0) << "no cell";
  EXPECT_NEAR(step_error(problem, {.enough = 1e-4, .faces = {10, 0, 0}}).wall, 0.3, 1e-6);
}

TEST(StepError, OfForcesInSlowPlacesIsNotHiddenByAFastWall) {
  for (const double drive : {0.0, 100.0}) {
    BodyProblem problem;
    add_column(problem, 3, 0, 0.7);
    problem.contacts[0].drive = drive;
    const StepError error = step_error(problem, {.enough = 1e-4});
    EXPECT_NEAR(error.contact, 0.3, 1e-6) << drive;
  }
}

TEST(StepError, IsNoneWhereTheLawHoldsAndWhereThereIsNoContact) {
  BodyProblem problem;
  add_grain(problem, Vec3::Zero(), 0);
  EXPECT_EQ(step_error(problem, {.enough = 1e-4}).relative(), 0);
  problem = {};
  add_column(problem, 30, 0, 1);
  EXPECT_LT(step_error(problem, {.enough = 1e-4}).relative(), 1e-9);
}

// A grain that hardly touches a wall on which a large bed stands: what is missing there is nothing to the
// wall, and all of what the small clusters give it.
TEST(StepError, OfAWallIsMeasuredByAllThatStandsOnIt) {
  BodyProblem problem = wedge(0.5, 0);
  const double whole = fall / (2 * std::sin(0.5));
  EXPECT_NEAR(step_error(problem, {.enough = 1e-4}).wall, 1, 1e-3);
  EXPECT_NEAR(step_error(problem, {.enough = 1e-4, .walls = 1000 * whole}).wall, 1e-3, 1e-5);
  EXPECT_NEAR(step_error(problem, {.enough = 1e-4, .walls = 1000 * whole}).contact, 1, 1e-3);
}

// A ball that flies along a groove: what rounding makes of the impulses there is no error of the walls, of
// which nothing else is. Steps were missed for 10^-24 N s.
TEST(StepError, OfAWallIsNoMoreThanRoundingWhereNothingPressesOnIt) {
  BodyProblem problem = wedge(0.5, 0);
  problem.bodies.back().free.u = Vec3(0, 1, -1e-20);
  for (Vec3& r : problem.impulse) r.setZero();
  const StepError error = step_error(problem, {.enough = 1e-4});
  EXPECT_GT(error.change[0][0].norm(), 0) << "the walls have to stop it";
  EXPECT_LT(error.wall, 1e-6);
}

/// Pressed apart by more than its weight asks for, a pair has to open: contacts that would pull are let go.
TEST(StepError, SeesContactsThatHaveToOpen) {
  BodyProblem problem;
  add_column(problem, 2, 0, 1);
  problem.bodies[1].free.u = Vec3(0, 0, 2);  // the upper one leaves
  problem.impulse[1] = Vec3(0, 0, fall);
  problem.impulse[0] = Vec3(0, 0, 2 * fall);
  const StepError error = step_error(problem, {.enough = 1e-6});
  EXPECT_TRUE(error.mends);
  EXPECT_NEAR(error.change[0][1][2], -fall, 1e-9);
  EXPECT_NEAR(error.change[0][0][2], -fall, 1e-9);
}

/// A grain jammed in a wedge of steep walls, a hair's breadth above both: as it comes down, its contacts have
/// to slide, and carry all the friction that they can. Impulses below that, which bear its weight as well,
/// leave each contact with next to nothing wrong, and sweeps creep.
TEST(StepError, OfAJammedGrainThatHasToSlideIsNotWhatItsContactsFindWrong) {
  constexpr double a = 0.0412, mu = 0.5, gap = 1.3e-5 * fall, used = 0.89;  // of the friction
  const double normal = fall / (2 * (std::sin(a) + used * mu * std::cos(a)));
  BodyProblem problem = wedge(a, mu);
  for (std::size_t k = 0; k < 2; ++k) {
    ContactEquation& contact = problem.contacts[k];
    contact.offset = gap * contact.normal;
    const Vec3 up = (Vec3::UnitZ() - contact.normal.z() * contact.normal).normalized();
    problem.impulse[k] = normal * (contact.normal + used * mu * up);
  }
  const StepError error = step_error(problem, {.enough = 1e-3});
  // At rest but for gap / sin(a).
  const double exact = (fall - gap / std::sin(a)) / (2 * (std::sin(a) + mu * std::cos(a)));
  EXPECT_EQ(error.worst, AnswerState::found);
  EXPECT_NEAR((problem.impulse[0] + error.change[0][0]).dot(problem.contacts[0].normal), exact, 1e-3 * exact);
  EXPECT_GT(error.contact, 0.08);
}

/// A grain on two floors. Where one is lower by next to nothing any shares are an answer to floors that
/// differ as little; where it is lower by as much as the step tells apart, the higher one carries all.
TEST(StepError, OfSharesOfRedundantContactsCountsTheirGapsAsFarAsTheyAreKnown) {
  for (const double lower : {1e-8, 1e-3}) {
    BodyProblem problem;
    const std::int32_t grain = add_grain(problem, Vec3::Zero(), 0);
    for (int wall = 0; wall < 2; ++wall) add_contact(problem, grain, -1, Vec3::UnitZ(), 0, wall);
    problem.contacts[1].offset = lower * fall * Vec3::UnitZ();
    problem.impulse = {0.3 * fall * Vec3::UnitZ(), 0.7 * fall * Vec3::UnitZ()};
    const StepError error = step_error(problem, {.enough = 1e-4});
    EXPECT_EQ(error.worst, AnswerState::found) << lower;
    EXPECT_NEAR(error.contact, lower < 1e-4 ? 0 : 0.7, 1e-6) << lower;
    EXPECT_LE(error.velocity, 5 * lower) << lower;
  }
}

/// Its first round alone does not say whether the contacts stick: no answer, so nothing is known.
TEST(StepError, OfAClusterWithoutAnAnswerIsNotWhatItHappenedToFind) {
  BodyProblem problem = wedge(0.0412, 0.5);
  const double normal = fall / (2 * std::sin(0.0412));
  for (std::size_t k = 0; k < 2; ++k) problem.impulse[k] = 0.5 * normal * problem.contacts[k].normal;
  StepErrorThresholds thresholds;
  thresholds.cluster.correction.most_sliding_rounds = 1;
  thresholds.cluster.least_budget = thresholds.cluster.budget_per_sweep = 0;
  const StepError error = step_error(problem, {.enough = 1e-3}, thresholds);
  EXPECT_EQ(error.worst, AnswerState::missing);
  EXPECT_GE(error.relative(), thresholds.unknown);
  // Sweeps of the step pay for an answer.
  thresholds.cluster.budget_per_sweep = 10;
  EXPECT_EQ(step_error(problem, {.enough = 1e-3, .sweeps = 0}, thresholds).worst, AnswerState::missing);
  EXPECT_EQ(step_error(problem, {.enough = 1e-3, .sweeps = 1000}, thresholds).worst, AnswerState::found);
}

TEST(StepError, WithFrictionASlidingGrainIsWhereCoulombSaysItIs) {
  BodyProblem problem;
  const std::int32_t grain = add_grain(problem, Vec3::Zero(), 0.3);
  problem.bodies[0].free.u = Vec3(1, 0, -0.1);
  add_contact(problem, grain, -1, Vec3::UnitZ(), 0.3, 0);
  problem.impulse[0] = Vec3(-0.03, 0, 0.1);  // the answer: r_n = m 0.1, r_t = mu r_n against the slip
  EXPECT_LT(step_error(problem, {.enough = 1e-4}).relative(), 1e-6);
  problem.impulse[0] *= 0.8;
  EXPECT_NEAR(step_error(problem, {.enough = 1e-4}).contact, 0.2, 0.02);
}

}  // namespace
}  // namespace talus::step_error_test
