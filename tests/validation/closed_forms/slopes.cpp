/// One body on a plane: rolling, sliding, resting. Velocities change linearly in time, which the theta-scheme
/// integrates exactly, so the tolerances here are rounding unless a test says otherwise.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/validation/experiment.hpp"

namespace talus::validation::closed_form_slopes_test {
namespace {

constexpr double h = 1e-3;

Scene on_slope(double angle, double mu, bool rotation, const Vec3& u = Vec3::Zero(), double radius = 0.1) {
  Scene scene(h);
  scene.slope(angle);
  scene.friction(mu);
  scene.setup.rotation = rotation;
  scene.sphere({0, 0, radius}, radius, 2.0, u);
  return scene;
}

TEST(Rolling, SphereAcceleratesWithFiveSeventhsOfGravityUpToTheSteepestSlopeThatRolls) {
  const double mu = 0.3, steepest = std::atan(3.5 * mu);
  for (double angle : {0.2 * steepest, 0.7 * steepest, 0.999 * steepest}) {
    Experiment run(on_slope(angle, mu, true));
    run.steps(500);
    const double a = 5.0 / 7 * g_earth * std::sin(angle), t = 500 * h;
    EXPECT_NEAR(run.u()[0], a * t, 1e-11 * a * t) << angle;
    EXPECT_NEAR(run.x()[0], 0.5 * a * t * t, 1e-11 * a * t * t) << angle;
    EXPECT_NEAR(run.w()[1], run.u()[0], 1e-11 * a * t) << "rolls without slip";
    EXPECT_NEAR(run.x()[2], 0.1, 1e-14);
    EXPECT_TRUE(run.simulation().report().converged);
  }
}

TEST(Rolling, SphereSlipsAndSpinsUpOnASteeperSlope) {
  const double mu = 0.3;
  for (double angle : {std::atan(3.5 * mu) * 1.001, 1.2}) {
    Experiment run(on_slope(angle, mu, true));
    run.steps(500);
    const double t = 500 * h;
    const double a = g_earth * (std::sin(angle) - mu * std::cos(angle));
    const double spin = 2.5 * mu * g_earth * std::cos(angle);  // R domega/dt
    EXPECT_NEAR(run.u()[0], a * t, 1e-11 * a * t) << angle;
    EXPECT_NEAR(run.w()[1], spin * t, 1e-11 * a * t) << angle;
    EXPECT_GT(run.u()[0], run.w()[1]) << "slips";
  }
}

TEST(Rolling, SlidingSphereRollsAfterTwoSeventhsOfItsSpeedAreLost) {
  const double mu = 0.25, v0 = 1.7;
  const double rolls_at = 2 * v0 / (7 * mu * g_earth);
  Experiment run(on_slope(0, mu, true, {v0, 0, 0}));
  double found = 0;
  while (run.u()[0] - run.w()[1] > 1e-12) {
    run.step();
    found = run.time();
    ASSERT_LT(found, 2 * rolls_at);
  }
  EXPECT_GE(found, rolls_at - 1e-12);
  EXPECT_LE(found, rolls_at + h) << "within one step";
  EXPECT_NEAR(run.u()[0], 5 * v0 / 7, 1e-12);
  run.steps(1000);
  EXPECT_NEAR(run.u()[0], 5 * v0 / 7, 1e-12) << "rolling on a level floor costs nothing";
}

TEST(Sliding, BackspinTurnsASphereRound) {
  // Angular momentum about the line of contact: 7/5 v = v0 - 2/5 w0, whatever the friction.
  const double v0 = 0.4, w0 = 2.0;
  Scene scene(h);
  scene.slope(0);
  scene.friction(0.2);
  scene.sphere({0, 0, 0.1}, 0.1, 2.0, {v0, 0, 0}).w[1] = -w0;
  Experiment run(std::move(scene));
  run.steps(1000);
  EXPECT_NEAR(run.u()[0], 5.0 / 7 * (v0 - 0.4 * w0), 1e-12);
  EXPECT_LT(run.u()[0], 0);
}

TEST(Sliding, BlockBelowTheFrictionAngleRestsExactly) {
  const double mu = 0.5;
  for (double angle : {0.0, 0.3 * std::atan(mu), 0.999 * std::atan(mu)}) {
    Experiment run(on_slope(angle, mu, false));
    const std::int64_t n = 2000;
    run.steps(n);
    // Creep: what rounding leaves of the velocity h g in each step, at worst all in one direction.
    const double creep = (run.x() - Vec3(0, 0, 0.1)).norm();
    RecordProperty(fmt::format("creep_m_at_{:.2f}", angle), fmt::format("{:.3e}", creep));
    EXPECT_LE(creep, static_cast<double>(n) * h * (4 * epsilon * h * g_earth) + 4 * epsilon * 0.1) << angle;
  }
}

TEST(Sliding, BlockAboveTheFrictionAngleAcceleratesWithTheDifference) {
  const double mu = 0.5;
  for (double angle : {1.001 * std::atan(mu), 1.0}) {
    Experiment run(on_slope(angle, mu, false));
    run.steps(500);
    const double t = 500 * h, a = g_earth * (std::sin(angle) - mu * std::cos(angle));
    EXPECT_NEAR(run.u()[0], a * t, 1e-11) << angle;
    EXPECT_NEAR(run.x()[0], 0.5 * a * t * t, 1e-11) << angle;
    EXPECT_EQ(run.w().norm(), 0) << "does not turn";
  }
}

TEST(Sliding, BlockStopsWhereFrictionHasTakenItsEnergy) {
  const double mu = 0.4, v0 = 1.3;
  Experiment run(on_slope(0, mu, false, {v0, 0, 0}));
  run.steps(1000);
  // The step in which it stops ends with v = 0 instead of passing through it: the path differs by O(h v).
  EXPECT_NEAR(run.x()[0], v0 * v0 / (2 * mu * g_earth), mu * g_earth * h * h);
  EXPECT_LE(std::abs(run.u()[0]), 4 * epsilon * h * g_earth);
}

TEST(Sliding, WithoutFrictionNothingTurnsAndTheSlopeIsFree) {
  const double angle = 0.4;
  Experiment run(on_slope(angle, 0, true));
  run.steps(500);
  const double t = 500 * h, a = g_earth * std::sin(angle);
  EXPECT_NEAR(run.u()[0], a * t, 1e-11);
  EXPECT_EQ(run.w().norm(), 0);
  EXPECT_TRUE(run.simulation().state().contacts.rx.empty()) << "no tangential impulses are kept";
}

TEST(Resting, HundredThousandStepsDoNotMoveABlock) {
  // Users of contact codes try this first. Level floor, and a slope just below the friction angle.
  for (double angle : {0.0, 0.45}) {
    Experiment run(on_slope(angle, 0.5, false, Vec3::Zero(), 0.05));
    run.steps(100000);
    const double creep = (run.x() - Vec3(0, 0, 0.05)).norm();
    RecordProperty(fmt::format("creep_m_at_{:.2f}", angle), fmt::format("{:.3e}", creep));
    EXPECT_LE(creep, 1e5 * h * 4 * epsilon * h * g_earth + 4 * epsilon * 0.05);
    EXPECT_LE(run.u().norm(), 4 * epsilon * h * g_earth);
  }
}

TEST(Resting, DroppedGrainComesToRestOnTheFloorNotInIt) {
  // The gap term lets a grain use up its gap and no more, wherever in a step the floor is met.
  for (int phase = 0; phase < 50; ++phase) {
    Scene scene(h);
    scene.slope(0);
    scene.sphere({0, 0, 0.1 + 0.01 + 1.7e-4 * phase}, 0.1, 1.0);
    Experiment run(std::move(scene));
    double lowest = 1;
    for (int k = 0; k < 200; ++k) {
      run.step();
      lowest = std::min(lowest, run.x()[2] - 0.1);
    }
    EXPECT_GE(lowest, -1e-15) << phase;
    EXPECT_NEAR(run.x()[2], 0.1, 1e-15) << phase;
    EXPECT_LE(run.u().norm(), 4 * epsilon * h * g_earth);
  }
}

}  // namespace
}  // namespace talus::validation::closed_form_slopes_test
