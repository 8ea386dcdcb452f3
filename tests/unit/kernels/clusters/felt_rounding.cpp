// What rounding of positions makes of a cluster with a heavy body in it.

#include "kernels/clusters/felt_rounding.hpp"

#include <gtest/gtest.h>

#include "kernels/clusters/step_error.hpp"
#include "tests/unit/kernels/clusters/cluster_makers.hpp"

namespace talus::felt_rounding_test {
namespace {

using namespace cluster_makers;

constexpr double heavy = 1e9;    // [kg] beside grains of 1 kg
constexpr double still = 1e-10;  // [m/s]: heavy * still is ten times what a grain weighs in a step

/// Two light grains, one on the other on a floor, and a heavy ball: beside the upper one, or on top.
BodyProblem column_and_ball(bool on_top, double part) {
  BodyProblem problem;
  for (const int k : {0, 1, 2}) add_grain(problem, Vec3(0, 0, 0.02 * k + 0.01), 0);
  problem.bodies[2].mass = heavy;
  add_contact(problem, 0, -1, Vec3::UnitZ(), 0, 0);
  add_contact(problem, 1, 0, Vec3::UnitZ(), 0);
  add_contact(problem, 2, 1, on_top ? Vec3::UnitZ() : Vec3::UnitX(), 0);
  const double above = on_top ? heavy : 0;
  for (const int k : {0, 1, 2}) {
    const double carried = k == 0 ? 2 + above : k == 1 ? 1 + above : above;
    problem.impulse[static_cast<std::size_t>(k)] =
        part * carried * fall * problem.contacts[static_cast<std::size_t>(k)].normal;
  }
  if (!on_top) problem.impulse[2] = 1e-6 * fall * Vec3::UnitX();
  return problem;
}

TEST(FeltRounding, OfABallThatLightGrainsHoldIsThatOfAllItsMass) {
  const ClusterGoal goal{1e-6 * heavy * fall, 1e-6, 100, still};
  const FeltRounding felt = felt_rounding(column_and_ball(true, 1), goal);
  EXPECT_GT(felt.momentum[2], 0.9 * heavy * still);
  EXPECT_LT(felt.all_momentum(), 4 * heavy * still);  // gaps of three contacts
}

TEST(FeltRounding, OfABallThatNothingHoldsIsThatOfTheGrainsThatItTouches) {
  const FeltRounding felt = felt_rounding(column_and_ball(false, 1), {1e-4 * fall, 1e-4, 100, still});
  EXPECT_GT(felt.all_momentum(), still);
  EXPECT_LT(felt.all_momentum(), 10 * still);
  for (const double impulse : felt.impulse) EXPECT_LT(impulse, 10 * still);
}

// Balls of 1000 kg that touched grains of a milligram hid that these fell through one another.
TEST(StepError, OfAColumnIsNotHiddenByTheRoundingOfAHeavyBallThatTouchesIt) {
  for (const double part : {0.5, 0.99}) {
    const StepError error = step_error(column_and_ball(false, part), {.enough = 1e-3, .still = still});
    EXPECT_NEAR(error.contact, 1 - part, 1e-3) << part;
    EXPECT_GT(error.velocity, 0.5 * (1 - part)) << part;
    EXPECT_TRUE(error.mends);
  }
}

}  // namespace
}  // namespace talus::felt_rounding_test
