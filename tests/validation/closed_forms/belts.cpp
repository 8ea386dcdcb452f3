/// Belts: walls whose surface moves while they stay where they are.

#include <gtest/gtest.h>

#include "tests/validation/clump_scenes.hpp"

namespace talus::validation::closed_form_belts_test {
namespace {

constexpr double radius = 0.01;  // [m]; h is that of the clumps' scenes

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

/// A disc that turns about z, or whose material alone does.
Scene on_turntable(double rate, bool rotates, bool surface_only, double step) {
  Scene scene(step);
  MotionPart turn = rotation_part(Vec3::UnitZ(), Vec3::Zero(), rate);
  turn.surface_only = surface_only;
  scene.wall("table", Vec3::Zero(), Vec3::UnitZ()).motion = {turn};
  scene.stage().gravity = {0, 0, -g_earth};
  scene.friction(5);
  scene.setup.rotation = rotates;
  return scene;
}

/// With the material's velocity where the contact is in the middle of the step, and not half-way of what it
/// does in it, friction did work: the block went outwards by Omega^2 h/2, 5 % in the first second.
TEST(Turntable, CarriesABlockAroundAtItsRadius) {
  for (const bool surface_only : {false, true}) {
    Scene scene = on_turntable(10, false, surface_only, h);
    scene.sphere({0.1, 0, radius}, radius, 0.7, {0, 1, 0});
    Experiment run(std::move(scene));
    run.steps(1000);
    EXPECT_NEAR(run.x().head<2>().norm(), 0.1, 2e-4 * 0.1) << surface_only;
    const double angle = std::atan2(run.x()[1], run.x()[0]);
    EXPECT_NEAR(std::remainder(angle - 10 * run.time(), 2 * pi), 0, 1e-3);
  }
}

/// Three balls in a triangle that lie on the table cannot roll: they turn with it.
TEST(Turntable, CarriesAClumpAround) {
  const double rate = 5, reach = 0.1, side = 2 * radius / std::sqrt(3.0);
  const Ball balls[] = {
      {{side, 0, 0}, radius}, {{-side / 2, radius, 0}, radius}, {{-side / 2, -radius, 0}, radius}};
  const PlacedClump placed = make_clump(balls);
  Scene scene = on_turntable(rate, true, false, h);
  scene.setup.clumps.push_back(placed.clump);
  add_clump(
      scene.bodies, scene.setup.clumps, 1, BodyId{0},
      {{reach, 0, radius}, placed.orientation, placed.radius, 2500, {0, rate * reach, 0}, {0, 0, rate}});
  Experiment run(std::move(scene));
  run.steps(1000);
  EXPECT_NEAR(run.x().head<2>().norm(), reach, 2e-4 * reach);
  EXPECT_NEAR(run.x()[2], radius, 1e-4 * radius);
  EXPECT_NEAR((omega_of(run, 0) - Vec3(0, 0, rate)).norm(), 0, 1e-3 * rate);
  const double angle = std::atan2(run.x()[1], run.x()[0]);
  EXPECT_NEAR(std::remainder(angle - rate * run.time(), 2 * pi), 0, 1e-3);
}

/// A solid ball that rolls goes in a circle, 2/7 as fast as the table turns (Earnshaw 1844).
TEST(Turntable, RollsABallInACircle) {
  const double rate = 10, slow = 2 * rate / 7, speed = 0.2;
  Scene scene = on_turntable(rate, true, false, h);
  scene.sphere({0, 0, radius}, radius, 0.7, {speed, 0, 0});
  scene.bodies.velocity.back().w[1] = speed;  // rolls where the table does not move
  Experiment run(std::move(scene));
  run.steps(2000);
  const Vec3 centre(0, speed / slow, radius);
  EXPECT_NEAR((run.x() - centre).norm(), speed / slow, 1e-3 * speed / slow);
  EXPECT_NEAR(run.u().norm(), speed, 1e-3 * speed);
  const double angle = std::atan2(run.u()[1], run.u()[0]);
  EXPECT_NEAR(std::remainder(angle - slow * run.time(), 2 * pi), 0, 1e-3);
}

}  // namespace
}  // namespace talus::validation::closed_form_belts_test
