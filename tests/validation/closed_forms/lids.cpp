/// Lids that weigh, shear under a load, gates that open, groups of walls.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>

#include "tests/validation/experiment.hpp"

namespace talus::validation::closed_form_lids_test {
namespace {

constexpr double h = 1e-3, radius = 0.01, mass = 0.7, mass_of_lid = 3;

/// Four balls on a floor, under a lid.
Scene under_lid(const WallLoad& load) {
  Scene scene(h);
  scene.wall("floor", Vec3::Zero(), Vec3::UnitZ());
  scene.wall("lid", {0, 0, 2 * radius}, -Vec3::UnitZ()).load = load;
  scene.stage().gravity = {0, 0, -g_earth};
  for (const double x : {-0.1, 0.1})
    for (const double y : {-0.1, 0.1}) scene.sphere({x, y, radius}, radius, mass);
  return scene;
}

WallLoad lid(bool weight, double force = 0) {
  return {.drive = WallDrive::force, .force = force, .mass = mass_of_lid, .weight = weight};
}

TEST(Lid, CarriesItsOwnMassIfAsked) {
  for (const bool weight : {true, false}) {
    Experiment run(under_lid(lid(weight, 5)));
    run.steps(50);
    const double presses = 5 + (weight ? mass_of_lid * g_earth : 0);
    EXPECT_NEAR(run.wall_force(1)[2], -presses, 1e-8);
    EXPECT_NEAR(run.wall_force(0)[2], presses + 4 * mass * g_earth, 1e-8);
    EXPECT_TRUE(run.simulation().report().converged);
  }
}

TEST(Lid, FallsFreely) {
  Scene scene(h);
  scene.wall("lid", {0, 0, 1}, -Vec3::UnitZ()).load = lid(true);
  scene.stage().gravity = {0, 0, -g_earth};
  scene.sphere({0, 0, -1}, radius, mass, {0, 0, 1});
  Experiment run(std::move(scene));
  run.steps(100);
  EXPECT_NEAR(run.simulation().walls()[0].velocity, g_earth * run.time(), 1e-12) << "along its normal";
  EXPECT_NEAR(run.simulation().walls()[0].position, -1 + 0.5 * g_earth * run.time() * run.time(), 1e-12);
}

/// Smooth balls packed closely between five walls: gaps of next to nothing decide who of redundant contacts
/// carries, and no search for that ends.
Scene packed_under_lid(int edge, int layers) {
  const double step = radius * std::sqrt(2.0), side = 2 * radius * edge;
  Scene scene(1e-4);
  scene.wall("floor", Vec3::Zero(), Vec3::UnitZ());
  scene.wall("lid", {0, 0, 2 * radius + (layers - 1) * step}, -Vec3::UnitZ()).load = lid(false, 5000);
  for (const int axis : {0, 1}) {
    scene.wall("low", Vec3::Zero(), Vec3::Unit(axis)).name += axis == 0 ? "x" : "y";
    scene.wall("high", side * Vec3::Unit(axis), -Vec3::Unit(axis)).name += axis == 0 ? "x" : "y";
  }
  scene.stage().gravity = {0, 0, -g_earth};
  for (int layer = 0; layer < layers; ++layer) {
    const int row = edge - layer % 2;  // those of odd layers lie in the hollows of the others
    for (int k = 0; k < row * row; ++k)
      scene.sphere(radius * Vec3(1 + layer % 2 + 2 * (k % row), 1 + layer % 2 + 2 * (k / row), 1) +
                       Vec3(0, 0, layer * step),
                   radius, 0.01);
  }
  scene.setup.solver.tolerance = scene.setup.solver.balance_tolerance = 1e-3;
  scene.setup.solver.max_iterations = 2000;
  scene.setup.solver.check_every = 10;
  return scene;
}

TEST(Lid, OnCloselyPackedSmoothBallsRestsThoughNobodyKnowsWhichOfThemCarry) {
  Experiment run(packed_under_lid(4, 5));
  const double weight = 66 * 0.01 * g_earth;
  std::int64_t sweeps = 0;
  for (int k = 1; k <= 8; ++k) {
    const StepReport& report = run.step();
    ASSERT_TRUE(report.converged) << "step " << k;
    sweeps += report.iterations;
    EXPECT_NEAR(run.wall_force(0)[2], 5000 + weight, 1e-3 * (5000 + weight)) << k;
    EXPECT_NEAR(run.wall_force(1)[2], -5000, 1e-3 * 5000) << k;
  }
  EXPECT_LT(sweeps, 1000) << "by sweeps that go on until direct solves may cost more";
}

TEST(Lid, ThatIsDraggedRollsItsBallsUnderConstantForce) {
  const double mu = 0.3, speed = 0.05, push = 40;
  WallLoad load = lid(false, push);
  load.velocity = {speed, 0, 0};
  Scene scene = under_lid(load);
  scene.friction(mu);
  Experiment run(std::move(scene));
  run.steps(400);
  for (const int id : {0, 1, 2, 3}) {
    EXPECT_NEAR(run.u(id)[0], speed / 2, 1e-8) << "rolls between lid and floor";
    EXPECT_NEAR(run.w(id)[1], speed / 2, 1e-8);
  }
  EXPECT_NEAR(run.wall_force(1)[2], -push, 1e-8);
  EXPECT_NEAR(run.wall_force(1)[0], 0, 1e-8);
}

TEST(Lid, ThatIsDraggedOverBallsThatDoNotTurnShearsThemByFriction) {
  const double mu = 0.3, speed = 0.5, push = 40;
  WallLoad load = lid(true, push);
  load.velocity = {0, speed, 0};
  Scene scene = under_lid(load);
  scene.friction(mu);
  scene.setup.rotation = false;
  Experiment run(std::move(scene));
  run.steps(50);
  const double presses = push + mass_of_lid * g_earth;
  EXPECT_NEAR(run.wall_force(1)[1], mu * presses, 1e-7);
  EXPECT_NEAR(run.wall_force(0)[1], -mu * presses, 1e-7) << "held by a floor that is pressed more";
  EXPECT_NEAR(run.simulation().walls()[1].work, mu * presses * speed * run.time(),
              0.03 * mu * presses * speed * run.time());
}

Stage next_stage(const Scene& scene, const std::string& name) {
  Stage stage = scene.setup.stages.front();
  stage.name = name;
  return stage;
}

TEST(Gate, LetsWhatItHeldFallWhenItVanishes) {
  Scene scene(h);
  scene.surface("disc", {{"centre", {0, 0, 0}}, {"axis", {0, 0, 1}}, {"radius", {0.5}}});
  scene.setup.walls.back().until_stage = "open";
  scene.stage().gravity = {0, 0, -g_earth};
  scene.setup.stages.push_back(next_stage(scene, "open"));
  scene.stage().end.steps = 50;
  scene.sphere({0, 0, radius}, radius, mass);
  Experiment run(std::move(scene));
  run.steps(50);
  EXPECT_NEAR(run.x()[2], radius, 1e-12);
  EXPECT_NEAR(run.wall_force(0)[2], mass * g_earth, 1e-9);
  run.next_stage();
  run.steps(60);
  EXPECT_NEAR(run.x()[2], radius - 0.5 * g_earth * 0.06 * 0.06, 1e-12);
  EXPECT_EQ(run.wall_force(0), Vec3::Zero());
}

TEST(Gate, ThatAppearsStopsWhatFalls) {
  Scene scene(h);
  scene.wall("floor", {0, 0, -0.1}, Vec3::UnitZ()).from_stage = "closed";
  scene.stage().gravity = {0, 0, -g_earth};
  scene.setup.stages.push_back(next_stage(scene, "closed"));
  scene.stage().end.steps = 50;
  scene.sphere({0, 0, radius}, radius, mass);
  Experiment run(std::move(scene));
  run.steps(50);
  EXPECT_NEAR(run.x()[2], radius - 0.5 * g_earth * 0.05 * 0.05, 1e-12);
  run.next_stage();
  run.steps(200);
  EXPECT_NEAR(run.x()[2], -0.1 + radius, 1e-3 * radius);
  EXPECT_NEAR(run.wall_force(0)[2], mass * g_earth, 1e-9);
}

MotionPart turning(double rate, const std::string& from = "") {
  MotionPart part;
  part.kind = MotionPart::Kind::rotation;
  part.axis = Vec3::UnitZ();
  part.point = {0.2, 0, 0};
  part.rate = rate;
  part.from_stage = from;
  return part;
}

TEST(StageOfAMotion, IsWhenItBegins) {
  Scene scene(h);
  scene.wall("table", Vec3::Zero(), Vec3::UnitZ()).motion = {turning(0.5, "turn")};
  scene.stage().gravity = {0, 0, -g_earth};
  scene.friction(0.6);
  scene.setup.rotation = false;
  scene.setup.stages.push_back(next_stage(scene, "turn"));
  scene.stage().end.steps = 100;
  scene.sphere({0.3, 0, radius}, radius, mass);
  Experiment run(std::move(scene));
  run.steps(100);
  EXPECT_EQ(run.x(), Vec3(0.3, 0, radius));
  run.next_stage();
  run.steps(500);
  // It slips until friction has brought it to the speed of the turntable, and goes round with it.
  const double angle = 0.5 * 500 * h, speed = 0.5 * 0.1, slips = speed * speed / (2 * 0.6 * g_earth);
  EXPECT_NEAR((run.x() - Vec3(0.2 + 0.1 * std::cos(angle), 0.1 * std::sin(angle), radius)).norm(), slips,
              0.2 * slips);
}

TEST(GroupOfWalls, TellsTheSumOfItsForcesAndTorques) {
  Scene scene(h);
  scene.setup.groups.push_back({"all", Vec3(0.1, 0.2, 0.3), {}});
  scene.wall("floor", Vec3::Zero(), Vec3::UnitZ()).group = "all";
  scene.wall("side", {-0.05, 0, 0}, Vec3(1, 0, 1)).group = "all";
  scene.wall("other", {0, 10, 0}, -Vec3::UnitY());
  scene.stage().gravity = {-2, 0, -g_earth};
  scene.friction(0.3);
  for (const double x : {0.0, 0.03, 0.06}) scene.sphere({x, 0, radius}, radius, mass);
  Experiment run(std::move(scene));
  run.steps(2000);
  const std::vector<WallReport> walls = run.simulation().walls(), groups = run.simulation().groups();
  ASSERT_EQ(groups.size(), 1u);
  EXPECT_EQ(groups[0].name, "all");
  EXPECT_NEAR((groups[0].force - walls[0].force - walls[1].force).norm(), 0, 1e-12);
  EXPECT_GT(walls[1].force.norm(), 0.1);
  // At rest it holds the weight, with its moment.
  Vec3 moment = Vec3::Zero();
  for (const int id : {0, 1, 2})
    moment += (run.x(id) - Vec3(0.1, 0.2, 0.3)).cross(mass * Vec3(-2, 0, -g_earth));
  EXPECT_NEAR((groups[0].force - 3 * mass * Vec3(2, 0, g_earth)).norm(), 0, 1e-3);
  EXPECT_NEAR((groups[0].torque + moment).norm(), 0, 1e-3);
}

TEST(TableOfAMotion, ThatEndsBeforeTheRunStopsIt) {
  MotionTable table;
  table.t = {0, 0.05};
  table.shift = {Vec3::Zero(), Vec3(0, 0, 0.01)};
  MotionPart part;
  part.kind = MotionPart::Kind::table;
  part.file = "way.csv";
  part.table = std::make_shared<const MotionTable>(table);
  Scene scene(h);
  scene.wall("plate", Vec3::Zero(), Vec3::UnitZ()).motion = {part};
  scene.stage().gravity = {0, 0, -g_earth};
  scene.sphere({0, 0, radius}, radius, mass);
  Experiment run(std::move(scene));
  run.steps(50);
  EXPECT_NEAR(run.simulation().walls()[0].position, 0.01, 1e-15);
  EXPECT_NEAR(run.u()[2], 0.2, 1e-12);
  try {
    run.step();
    ADD_FAILURE() << "goes on";
  } catch (const RunawayError& error) {
    const std::string said = error.what();
    EXPECT_NE(
        said.find("step 51 (stage 'all'): the motion of wall 'plate' ends at 0.05 s in its table way.csv"),
        std::string::npos)
        << said;
  }
}

}  // namespace
}  // namespace talus::validation::closed_form_lids_test
