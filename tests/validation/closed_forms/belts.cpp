/// Belts: walls whose surface moves while they stay where they are.

#include <gtest/gtest.h>

#include "tests/validation/experiment.hpp"

namespace talus::validation::closed_form_belts_test {
namespace {

constexpr double h = 1e-3, radius = 0.01;  // [s], [m]

MotionPart belt(const Vec3& velocity) {
  MotionPart part;
  part.velocity = velocity;
  part.surface_only = true;
  return part;
}

Scene on_belt(double speed, double mu, bool rotates) {
  Scene scene(h);
  scene.wall("belt", Vec3::Zero(), Vec3::UnitZ()).motion = {belt({speed, 0, 0})};
  scene.stage().gravity = {0, 0, -g_earth};
  scene.friction(mu);
  scene.setup.rotation = rotates;
  scene.sphere({0, 0, radius}, radius, 0.7);
  return scene;
}

TEST(Conveyor, BringsASphereToTwoSeventhsOfItsSpeedInTheTimeThatFrictionTakes) {
  const double mu = 0.2, speed = 0.7, rolls_at = 2 * speed / (7 * mu * g_earth);
  Experiment run(on_belt(speed, mu, true));
  run.steps(static_cast<std::int64_t>(rolls_at / h));
  EXPECT_NEAR(run.u()[0], mu * g_earth * run.time(), 1e-10);
  EXPECT_LT(run.u()[0] - run.w()[1], speed) << "slips as yet";
  run.steps(2);
  EXPECT_NEAR(run.u()[0], 2.0 / 7 * speed, 1e-10);
  EXPECT_NEAR(run.u()[0] - run.w()[1], speed, 1e-10) << "rolls on the belt";
  // What the belt gave is half in the sphere, half in heat: friction acts over twice the way.
  EXPECT_NEAR(run.kinetic_energy(), 0.5 * run.simulation().walls()[0].work, 1e-3 * run.kinetic_energy());
}

TEST(Conveyor, CarriesWhatDoesNotRollAtItsSpeedWhileItsFloorStays) {
  const double mu = 0.2, speed = 0.7;
  Experiment run(on_belt(speed, mu, false));
  run.steps(static_cast<std::int64_t>(speed / (mu * g_earth) / h));
  EXPECT_NEAR(run.u()[0], mu * g_earth * run.time(), 1e-10);
  run.steps(200);
  EXPECT_NEAR(run.u()[0], speed, 1e-10);
  EXPECT_NEAR(run.x()[2], radius, 1e-13);
  EXPECT_EQ(run.simulation().walls()[0].position, 0);
  EXPECT_NEAR(run.wall_force(0)[2], 0.7 * g_earth, 1e-9);
}

}  // namespace
}  // namespace talus::validation::closed_form_belts_test
