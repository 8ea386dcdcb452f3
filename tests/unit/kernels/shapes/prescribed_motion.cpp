/// Motions of walls, against closed forms of their own.

#include "kernels/shapes/prescribed_motion.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "kernels/shapes/walls.hpp"

namespace talus::prescribed_motion_test {
namespace {

constexpr double two_pi = 6.28318530717958648;

/// Where a point goes that has the velocity of `twist` for a time h, by many small steps.
Vec3 carried(const RigidVelocity& twist, const Vec3& from, double h) {
  constexpr int steps = 4000;
  Vec3 x = from, pivot = twist.pivot;
  for (int k = 0; k < steps; ++k) {
    const double dt = h / steps;
    // The pivot moves with its own velocity, and the field with it as a rigid body's.
    const auto speed = [&](const Vec3& c) { return Vec3(twist.velocity + twist.omega.cross(c - pivot)); };
    const Vec3 middle = x + 0.5 * dt * speed(x);
    x += dt * speed(middle);
  }
  return x;
}

TEST(PrescribedMotion, RotationTurnsAboutItsLine) {
  const std::vector<MotionPart> parts = {rotation_part({0, 0, 2}, {1, 0, 5}, 0.5)};
  const double angle = 0.5 * 3;
  const Pose pose = pose_at(parts, 3);
  EXPECT_LT((pose.of({2, 0, 1}) - Vec3(1 + std::cos(angle), std::sin(angle), 1)).norm(), 1e-15);
  EXPECT_LT((pose.back(pose.of({2, 7, 1})) - Vec3(2, 7, 1)).norm(), 1e-14);
  EXPECT_LT((pose.turned({1, 0, 0}) - Vec3(std::cos(angle), std::sin(angle), 0)).norm(), 1e-15);
}

TEST(PrescribedMotion, OscillationBeginsWhereTheWallIs) {
  const std::vector<MotionPart> parts = {oscillation_part({0, 3, 4}, 0.2, 5, 0.7)};
  EXPECT_EQ(pose_at(parts, 0).of({1, 2, 3}), Vec3(1, 2, 3));
  const double t = 0.123, way = 0.2 * (std::sin(two_pi * 5 * t + 0.7) - std::sin(0.7));
  EXPECT_LT((pose_at(parts, t).of({1, 2, 3}) - Vec3(1, 2 + 0.6 * way, 3 + 0.8 * way)).norm(), 1e-15);
}

TEST(PrescribedMotion, RotationsFollowOneAnotherAboutLinesInSpaceAndDisplacementsAreAdded) {
  MotionPart drift;
  drift.velocity = {1, 0, 0};
  const double quarter = two_pi / 4;
  const std::vector<MotionPart> parts = {rotation_part({0, 0, 1}, Vec3::Zero(), quarter), drift,
                                         rotation_part({1, 0, 0}, Vec3::Zero(), quarter)};
  // After 1 s: x goes to y and then to z.
  EXPECT_LT((pose_at(parts, 1).of({1, 0, 0}) - Vec3(1, 0, 1)).norm(), 1e-15);
}

TEST(PrescribedMotion, LiesStillBeforeItBeginsAndAfterItHasEnded) {
  MotionPart part = rotation_part({0, 0, 1}, Vec3::Zero(), 1);
  part.begin = 2;
  part.end = 3;
  EXPECT_EQ(displacement(part, 1).angle, 0);
  EXPECT_EQ(displacement(part, 2.5).angle, 0.5);
  EXPECT_EQ(displacement(part, 9).angle, 1);
  EXPECT_EQ(mean_velocity({&part, 1}, 9, 0.1).omega, Vec3::Zero());
  EXPECT_DOUBLE_EQ(advance(part, 1.75, 0.5).angle, 0.25) << "begins within the step";
  EXPECT_DOUBLE_EQ(mean_velocity({&part, 1}, 2.25, 0.1).omega[2], 1);
}

TEST(PrescribedMotion, TwistOfAStepBringsEveryPointWhereThePoseHasIt) {
  const std::vector<std::vector<MotionPart>> motions = {
      {rotation_part({1, 2, 3}, {0.3, -0.2, 0.5}, 1.7)},
      {oscillation_part({1, 1, 0}, 0.1, 3, 0.4)},
      {rotation_part({1, 2, 3}, {0.3, -0.2, 0.5}, 1.7), oscillation_part({1, 1, 0}, 0.1, 3, 0.4)},
      {rotation_part({0, 0, 1}, {1, 0, 0}, 2), rotation_part({1, 0, 1}, {0, 0.3, 0}, -1.2),
       oscillation_part({1, 0, 0}, 0.1, 3, 0)}};
  const double t = 0.37, h = 0.05;
  for (std::size_t m = 0; m < motions.size(); ++m) {
    const RigidVelocity twist = mean_velocity(motions[m], t, h);
    for (const Vec3& first : {Vec3(0, 0, 0), Vec3(1, -2, 0.5), Vec3(-0.3, 0.8, 2)}) {
      const Vec3 now = pose_at(motions[m], t).of(first), then = pose_at(motions[m], t + h).of(first);
      EXPECT_LT((carried(twist, now, h) - then).norm(), 1e-9) << m;
      EXPECT_GT((now - then).norm(), 1e-4) << m;
    }
  }
}

TEST(PrescribedMotion, RateOfARotationIsExactHoweverShortTheStepAndLateTheTime) {
  const std::vector<MotionPart> parts = {rotation_part({0, 1, 0}, Vec3::Zero(), -2)};
  const RigidVelocity twist = mean_velocity(parts, 1e5, 1e-6);
  EXPECT_NEAR(twist.omega[1], -2, 1e-14);
  EXPECT_EQ(twist.velocity, Vec3::Zero());
}

MotionTable table_of_velocity() {
  MotionTable table;
  table.t = {0, 1, 3};
  table.velocity = {Vec3(0, 0, 0), Vec3(2, 0, 0), Vec3(2, 4, 0)};
  integrate(table);
  return table;
}

TEST(PrescribedMotion, TableOfVelocitiesIsIntegrated) {
  MotionPart part;
  part.kind = MotionPart::Kind::table;
  part.table = std::make_shared<const MotionTable>(table_of_velocity());
  EXPECT_DOUBLE_EQ(displacement(part, 0.5).shift[0], 0.25) << "t squared";
  EXPECT_DOUBLE_EQ(displacement(part, 1).shift[0], 1);
  EXPECT_DOUBLE_EQ(displacement(part, 2).shift[0], 3);
  EXPECT_DOUBLE_EQ(displacement(part, 2).shift[1], 1);
  EXPECT_DOUBLE_EQ(displacement(part, 3).shift[1], 4);
}

TEST(PrescribedMotion, SurfaceThatMovesAloneStaysAndItsMaterialMovesAlongIt) {
  Wall wall;
  MotionPart part = rotation_part({0, 0, 1}, {1, 0, 0}, 2);
  part.surface_only = true;
  MotionPart along;
  along.velocity = {0, 1, 5};
  along.surface_only = true;
  wall.motion = {part, along};
  EXPECT_FALSE(pose_at(wall.motion, 3).moved);
  wall.belt = mean_surface_velocity(wall.motion, 3, 0.1, Vec3::Zero());
  EXPECT_LT((wall.drift_at({2, 0, 0}, Vec3::UnitZ(), Vec3::Zero()) - Vec3(0, 3, 0)).norm(), 1e-14);
  EXPECT_EQ(wall.velocity_at({2, 0, 0}), Vec3::Zero());
  EXPECT_TRUE(wall.has_drift());
}

TEST(PrescribedMotion, OfABeltGoesWithItsWall) {
  MotionPart part;
  part.velocity = {1, 0, 0};
  part.surface_only = true;
  const std::vector<MotionPart> parts = {rotation_part({0, 0, 1}, Vec3::Zero(), two_pi / 4), part};
  EXPECT_LT((mean_surface_velocity(parts, 1, 1e-3, Vec3::Zero()).velocity - Vec3(0, 1, 0)).norm(), 1e-12);
}

}  // namespace
}  // namespace talus::prescribed_motion_test
