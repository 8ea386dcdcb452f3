// Proximal steps to the answer of a cluster, against closed forms.

#include "kernels/clusters/proximal_newton.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/kernels/clusters/cluster_makers.hpp"

namespace talus::proximal_newton_test {
namespace {

using namespace cluster_makers;

Correction corrected(const BodyProblem& problem) {
  double work = 1e9;
  return proximal_correction(problem, {.enough = enough}, {}, {}, work).best;
}

TEST(ProximalSteps, FindTheForcesInAWedgeHoweverSharpItIs) {
  for (const double a : {0.5, 1e-2, 1e-3}) {
    const BodyProblem problem = wedge(a, 0);
    const Correction answer = corrected(problem);
    ASSERT_TRUE(answer.settled) << a;
    const double exact = fall / (2 * std::sin(a));
    for (std::size_t k = 0; k < 2; ++k)
      EXPECT_NEAR(impulse_of(problem, answer, k).norm(), exact, 1e-3 * exact) << a;
    EXPECT_NEAR(answer.motion[0].u.z(), fall, enough) << "at rest";
  }
}

/// Two floors, the second lower by what is nothing to the grain: the law would have the first carry all, and
/// gaps that differ so little leave the shares as they are.
TEST(ProximalSteps, LeaveRedundantContactsTheSharesThatTheyHave) {
  for (const double share : {0.3, 0.5, 0.8}) {
    BodyProblem problem;
    const std::int32_t grain = add_grain(problem, Vec3::Zero(), 0);
    for (int wall = 0; wall < 2; ++wall) add_contact(problem, grain, -1, Vec3::UnitZ(), 0, wall);
    problem.contacts[1].offset = 1e-12 * fall * Vec3::UnitZ();
    problem.impulse = {share * fall * Vec3::UnitZ(), (0.9 - share) * fall * Vec3::UnitZ()};
    const Correction answer = corrected(problem);
    ASSERT_TRUE(answer.settled);
    // A tenth of the weight is missing, and both take half of it.
    EXPECT_NEAR(impulse_of(problem, answer, 0).z(), (share + 0.05) * fall, 1e-3 * fall) << share;
    EXPECT_NEAR(impulse_of(problem, answer, 1).z(), (0.95 - share) * fall, 1e-3 * fall) << share;
  }
}

/// The same where positions are far from the origin, so that rounding makes gaps differ by more.
TEST(ProximalSteps, DoNotShareForcesByWhatRoundingMakesInGaps) {
  BodyProblem problem;
  const std::int32_t grain = add_grain(problem, Vec3::Zero(), 0);
  for (int wall = 0; wall < 2; ++wall) add_contact(problem, grain, -1, Vec3::UnitZ(), 0, wall);
  const double rounding = 1e-10 * fall;
  problem.contacts[1].offset = rounding * Vec3::UnitZ();
  problem.impulse = {0.4 * fall * Vec3::UnitZ(), 0.5 * fall * Vec3::UnitZ()};
  for (const bool told : {false, true}) {
    double work = 1e9;
    const Correction answer =
        proximal_correction(problem, {.enough = enough, .still = told ? 2 * rounding : 0}, {}, {}, work).best;
    ASSERT_TRUE(answer.settled);
    EXPECT_NEAR(impulse_of(problem, answer, 0).z(), (told ? 0.45 : 1) * fall, 1e-2 * fall) << told;
    EXPECT_NEAR(impulse_of(problem, answer, 1).z(), (told ? 0.55 : 0) * fall, 1e-2 * fall) << told;
  }
}

TEST(ProximalSteps, FindWhoCarriesALidWhereOnlyFirmStepsSeeIt) {
  // W resists a change of the shares by lean^2: a step of firmness 10^6 takes no more than a thousandth of
  // what is left where contacts lean least, moves the bodies by less than need be known, and is no answer.
  const double apart = 0.5;
  for (const double give : {1e-9, 1e-5, 1e-2, 1.0})  // of the lid, where all is on grain a
    for (const double lean : {1e-1, 1e-2, 1e-3, 1e-4, 3e-5}) {
      const BodyProblem problem = under_a_lid(lean, apart * lean * lean, give / (lean * lean), 0);
      double work = 1e9;
      const Correction answer = proximal_correction(problem, {.enough = 2e-4}, {}, {}, work).best;
      ASSERT_TRUE(answer.settled) << lean << ' ' << give;
      const double a = -impulse_of(problem, answer, 2).z(), b = -impulse_of(problem, answer, 3).z();
      EXPECT_NEAR(a - b, apart, 1e-2) << lean << ' ' << give;
      EXPECT_NEAR(a + b, (1 - give * apart / 2) / (1 + give / 2), 2e-4) << lean << ' ' << give;
    }
}

/// Two walls close on a grain by less than is asked for: no force opens them, and each step presses harder.
TEST(ProximalSteps, DoNotTakeForcesWithoutBoundForAnAnswer) {
  BodyProblem problem;
  const std::int32_t grain = add_grain(problem, Vec3::Zero(), 0);
  for (const int side : {-1, 1}) {
    add_contact(problem, grain, -1, side * Vec3::UnitX(), 0, 0);
    problem.contacts.back().offset = -1e-6 * side * Vec3::UnitX();
  }
  double work = 1e9;
  EXPECT_FALSE(proximal_correction(problem, {.enough = 1e-2}, {}, {}, work).best.settled);
  // It is that bound which tells: without it the last step seems to change next to nothing.
  ProximalThresholds boundless;
  boundless.most_growth = 1e300;
  EXPECT_TRUE(proximal_correction(problem, {.enough = 1e-2}, {}, boundless, work).best.settled);
}

TEST(ProximalSteps, KeepToTheirWorkAndSaySo) {
  const BodyProblem problem = wedge(1e-3, 0);
  double work = 1;
  EXPECT_FALSE(proximal_correction(problem, {.enough = enough}, {}, {}, work).best.settled);
  EXPECT_LE(work, 0);
  EXPECT_GT(work, -1e4) << "one factorisation of one grain";
  work = 1e9;
  EXPECT_TRUE(proximal_correction(problem, {.enough = enough}, {}, {}, work).best.settled);
  EXPECT_LT(work, 1e9);
  EXPECT_GT(work, 0.9e9);
}

}  // namespace
}  // namespace talus::proximal_newton_test
