/// Walls that move by themselves: plates that shake, drums, tumbling boxes.

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/validation/experiment.hpp"

namespace talus::validation::closed_form_motions_test {
namespace {

constexpr double h = 1e-3, radius = 0.01;  // [s], [m]

/// A ball on a plate that rises from rest as A (1 - cos(2 pi f t)).
Experiment on_plate(double acceleration, double frequency, double step) {
  const double pulsation = 2 * pi * frequency;
  Scene scene(step);
  MotionPart& shaking = scene.wall("plate", Vec3::Zero(), Vec3::UnitZ())
                            .motion.emplace_back(oscillation_part(
                                Vec3::UnitZ(), acceleration / (pulsation * pulsation), frequency));
  shaking.phase = -pi / 2;
  scene.stage().gravity = {0, 0, -g_earth};
  scene.sphere({0, 0, radius}, radius, 0.7);
  return Experiment(std::move(scene));
}

TEST(ShakenPlate, KeepsABallThatItPullsDownByLessThanGravity) {
  Experiment run = on_plate(0.98 * g_earth, 5, h);
  for (int k = 0; k < 800; ++k) {
    run.step();
    EXPECT_GT(run.wall_force(0)[2], 0) << run.time();
    // The ball goes straight from the middle of a step to that of the next.
    EXPECT_NEAR(run.x()[2] - radius, run.simulation().walls()[0].position, g_earth * h * h / 4);
  }
}

TEST(ShakenPlate, LosesABallWhereItsAccelerationIsThatOfGravityAndMeetsItAgain) {
  const double a = 1.5 * g_earth, f = 5, pulsation = 2 * pi * f, A = a / (pulsation * pulsation);
  const double step = 1e-4, leaves_at = std::acos(-g_earth / a) / pulsation;
  Experiment run = on_plate(a, f, step);
  while (run.time() < 0.5 * leaves_at) run.step();
  while (run.wall_force(0)[2] > 0) run.step();
  EXPECT_NEAR(run.time(), leaves_at, 3 * step);
  // It flies as it was thrown, until the plate comes again.
  const auto plate = [&](double t) { return A * (1 - std::cos(pulsation * t)); };
  const double z = plate(leaves_at), v = A * pulsation * std::sin(pulsation * leaves_at);
  const auto flight = [&](double t) {
    return z + v * (t - leaves_at) - 0.5 * g_earth * (t - leaves_at) * (t - leaves_at);
  };
  double meets_at = leaves_at + 0.05;
  while (flight(meets_at) > plate(meets_at)) meets_at += 1e-6;
  while (run.wall_force(0)[2] == 0) {
    run.step();
    if (run.time() > meets_at - 3 * step) continue;
    EXPECT_NEAR(run.x()[2] - radius, flight(run.time()), 3e-4 * A);
  }
  EXPECT_NEAR(run.time(), meets_at, 3 * step);
}

constexpr double drum_radius = 0.1, turns = 1.0;  // [m], [rad/s]

/// A drum about the axis y that turns, so that its bottom moves along -x.
Scene drum(double mu, bool rotates) {
  Scene scene(h);
  scene.surface(
      "cylinder",
      {{"start", {0, -0.03, 0}}, {"end", {0, 0.03, 0}}, {"radius", {drum_radius}}, {"inside", {1}}});
  scene.setup.walls.back().motion = {rotation_part(Vec3::UnitY(), Vec3::Zero(), turns)};
  scene.stage().gravity = {0, 0, -g_earth};
  scene.friction(mu);
  scene.setup.rotation = rotates;
  return scene;
}

/// A ball at the wall, `angle` up from the bottom on the side to which it is carried.
void ball_at(Scene& scene, double angle, double speed) {
  const double r = drum_radius - radius;
  scene.sphere(r * Vec3(-std::sin(angle), 0, -std::cos(angle)), radius, 0.7,
               speed * Vec3(-std::cos(angle), 0, std::sin(angle)));
}

double angle_of(const Vec3& x) {
  return std::atan2(-x[0], -x[2]);
}

TEST(Drum, CarriesWhatSticksUntilFrictionIsNotEnough) {
  const double mu = 0.4, r = drum_radius - radius;
  Scene scene = drum(mu, false);
  ball_at(scene, 0, drum_radius * turns);
  Experiment run(std::move(scene));
  // A slider's centre goes round at the speed of the wall, on a smaller circle.
  const double around = drum_radius * turns / r, centrifugal = r * around * around / g_earth;
  double slips = 0;
  while (std::sin(slips) < mu * (std::cos(slips) + centrifugal)) slips += 1e-6;
  while (angle_of(run.x()) < slips - 2 * around * h) {
    run.step();
    EXPECT_NEAR(angle_of(run.x()), around * run.time(), 1e-3 * (0.01 + around * run.time()));
  }
  run.steps(200);
  EXPECT_LT(angle_of(run.x()), 0.95 * around * run.time()) << "slips";
}

TEST(Drum, HoldsASlidingBallAtTheAngleOfFrictionAndFeelsItsTorque) {
  const double mu = 0.3, lift = std::atan(mu);
  Scene scene = drum(mu, false);
  ball_at(scene, lift, 0);
  Experiment run(std::move(scene));
  run.steps(300);
  EXPECT_NEAR(angle_of(run.x()), lift, 1e-6);
  const WallReport wall = run.simulation().walls()[0];
  const double torque = 0.7 * g_earth * std::sin(lift) * drum_radius;
  EXPECT_NEAR(wall.torque[1], torque, 1e-5 * torque) << "as the drum turns";
  EXPECT_NEAR(wall.torque[0], 0, 1e-12);
  EXPECT_NEAR(wall.torque[2], 0, 1e-12);
  EXPECT_NEAR(wall.work, torque * turns * run.time(), 1e-3 * wall.work);
}

TEST(Drum, HoldsABallThatResistsRollingAtTheAngleOfThatResistance) {
  const double mu = 0.5, resistance = 0.05, lift = std::atan(resistance);
  Scene scene = drum(mu, true);
  scene.stage().laws.set_all(&PairLaw::rolling_resistance, resistance);
  ball_at(scene, lift, 0);
  scene.bodies.velocity[0].w[1] = turns * drum_radius;
  Experiment run(std::move(scene));
  run.steps(200);
  EXPECT_NEAR(angle_of(run.x()), lift, 1e-4 * lift);
  EXPECT_NEAR(run.w()[1], turns * drum_radius, 1e-4 * turns * drum_radius);
  // What turns evenly where it is takes from the drum what its weight takes from it: the moment about the
  // axis is that of the force at the shell less what resists rolling there.
  const double torque = 0.7 * g_earth * std::sin(lift) * (drum_radius - radius);
  const WallReport wall = run.simulation().walls()[0];
  EXPECT_NEAR(wall.torque[1], torque, 1e-3 * torque);
  EXPECT_NEAR(wall.work, torque * turns * run.time(), 2e-3 * wall.work);
}

// Without gravity, as a grain of the drum: it turns with the shell and rolls on nothing, however much it
// would resist.
TEST(Drum, CarriesABallThatTurnsWithItAsIfItWereGluedToTheShell) {
  Scene scene = drum(0.9, true);
  scene.stage().gravity = Vec3::Zero();
  scene.stage().laws.set_all(&PairLaw::rolling_resistance, 0.2);
  ball_at(scene, 0.3, 0);
  const Vec3 u = Vec3(0, turns, 0).cross(scene.bodies.x[0]);
  std::copy_n(u.data(), 3, scene.bodies.velocity[0].u);
  scene.bodies.velocity[0].w[1] = radius * turns;
  Experiment run(std::move(scene));
  run.steps(200);
  EXPECT_NEAR(run.w()[1], radius * turns, 1e-3 * radius * turns);
  EXPECT_NEAR(run.u().norm(), u.norm(), 1e-3 * u.norm());
}

using Triangles = std::vector<Triangle>;

/// The space of the grains in a prism of n sides about y, with both ends, as a mesh.
Triangles prism(int n, double outer, double half) {
  Triangles triangles;
  const auto corner = [&](int k, double y) {
    const double angle = 2 * pi * k / n;
    return Vec3(outer * std::sin(angle), y, outer * std::cos(angle));
  };
  for (int k = 0; k < n; ++k) {
    const int next = (k + 1) % n;
    const Vec3 a = corner(k, -half), b = corner(next, -half), c = corner(next, half), d = corner(k, half);
    triangles.push_back({a, b, c});
    triangles.push_back({a, c, d});
    triangles.push_back({Vec3(0, -half, 0), b, a});
    triangles.push_back({Vec3(0, half, 0), d, c});
  }
  return triangles;
}

TEST(Drum, OfTrianglesCarriesAsACylinderWithDiscsDoes) {
  constexpr int sides = 240;
  const double mu = 0.6, sagitta = drum_radius * (1 - std::cos(pi / sides));
  const auto carried = [&](bool mesh) {
    Scene scene = drum(mu, false);
    const std::vector<MotionPart> motion = scene.setup.walls.back().motion;
    if (mesh) {
      scene.setup.walls.clear();
      scene.surface("mesh", {{"inside", {1}}}, prism(sides, drum_radius, 0.03));
    } else {
      for (const double y : {-0.03, 0.03})
        scene.surface("disc", {{"centre", {0, y, 0}}, {"axis", {0, 1, 0}}, {"radius", {drum_radius}}});
      scene.setup.walls.back().name = "other disc";
    }
    for (Wall& wall : scene.setup.walls) wall.motion = motion;
    ball_at(scene, 0, drum_radius * turns);
    Experiment run(std::move(scene));
    run.steps(400);
    return run.x();
  };
  EXPECT_NEAR((carried(true) - carried(false)).norm(), 0, 4 * sagitta);
}

/// A cube of side 2 about the centre, whose walls turn about a diagonal: six rectangles, or a mesh.
Scene tumbler(bool mesh, double restitution, double mu) {
  Scene scene(h);
  if (mesh) {
    Triangles triangles;
    for (int axis = 0; axis < 3; ++axis)
      for (const double side : {-1.0, 1.0}) {
        const Vec3 n = side * Vec3::Unit(axis), a = Vec3::Unit((axis + 1) % 3), b = n.cross(a);
        triangles.push_back({n - a - b, n + a - b, n + a + b});
        triangles.push_back({n - a - b, n + a + b, n - a + b});
      }
    scene.surface("mesh", {{"inside", {1}}}, triangles);
  } else {
    const auto numbers = [](const Vec3& v) { return std::vector<double>(v.begin(), v.end()); };
    for (int axis = 0; axis < 3; ++axis)
      for (const double side : {-1.0, 1.0}) {
        const Vec3 n = side * Vec3::Unit(axis), a = Vec3::Unit((axis + 1) % 3),
                   b = Vec3::Unit((axis + 2) % 3);
        scene.surface(
            "rectangle",
            {{"corner", numbers(n - a - b)}, {"edge_a", numbers(2 * a)}, {"edge_b", numbers(2 * b)}});
        scene.setup.walls.back().name += std::to_string(scene.setup.walls.size());
      }
  }
  for (Wall& wall : scene.setup.walls)
    wall.motion = {rotation_part({1, 1, 1}, {0.1, 0, 0}, 1.3), oscillation_part({1, 0, 0}, 0.05, 0.7)};
  scene.stage().laws.set_all(&PairLaw::restitution, restitution);
  scene.friction(mu);
  scene.sphere({0.1, 0.2, 0.3}, 0.2, 0.7, {0.5, -0.8, 0.3});
  scene.sphere({-0.4, -0.3, 0.1}, 0.25, 1.1, {0.1, 0.4, -0.7});
  return scene;
}

TEST(Tumbler, OfRectanglesAndOfTrianglesMoveGrainsAlike) {
  Experiment plates(tumbler(false, 0.6, 0.3)), mesh(tumbler(true, 0.6, 0.3));
  plates.steps(1500);
  mesh.steps(1500);
  for (const int id : {0, 1}) {
    EXPECT_NEAR((plates.x(id) - mesh.x(id)).norm(), 0, 1e-7);
    EXPECT_NEAR((plates.u(id) - mesh.u(id)).norm(), 0, 1e-6);
  }
  EXPECT_GT(plates.kinetic_energy(), 0.2) << "has been moved";
}

TEST(Tumbler, MeetsTheSameWallsWhateverTheSkinIs) {
  const auto moved = [](double skin) {
    Scene scene = tumbler(true, 0.6, 0.3);
    scene.setup.detection.skin = skin;
    Experiment run(std::move(scene));
    run.steps(1500);
    return std::pair{run.x(0), run.x(1)};
  };
  const auto often = moved(0), seldom = moved(0.5);
  EXPECT_NEAR((often.first - seldom.first).norm(), 0, 1e-8);
  EXPECT_NEAR((often.second - seldom.second).norm(), 0, 1e-8);
}

double work_of(const Experiment& run) {
  double work = 0;
  for (const WallReport& wall : run.simulation().walls()) work += wall.work;
  return work;
}

TEST(Tumbler, OfSmoothElasticWallsGivesItsWorkToTheGrains) {
  for (const RestitutionLaw law : {RestitutionLaw::newton, RestitutionLaw::moreau}) {
    Scene scene = tumbler(false, 1, 0);
    scene.setup.solver.restitution_law = law;
    Experiment run(std::move(scene));
    const double before = run.kinetic_energy();
    double most = 0;
    for (int k = 0; k < 4000; ++k) {
      run.step();
      most = std::max(most, std::abs(work_of(run)));
      ASSERT_NEAR(run.kinetic_energy() - before, work_of(run), 1e-10 * (1 + most)) << run.time();
    }
    EXPECT_GT(most, 0.05) << "walls have worked";
  }
}

TEST(Tumbler, OfRoughWallsGivesMoreThanGrainsKeep) {
  Experiment run(tumbler(false, 0.3, 0.5));
  double lost = run.kinetic_energy();
  for (int k = 0; k < 2000; ++k) {
    run.step();
    const double now = run.kinetic_energy() - work_of(run);
    ASSERT_LE(now, lost + 1e-12) << run.time();
    lost = now;
  }
}

TEST(Tumbler, FollowsItsForcesAndTorques) {
  // Power is force . velocity of a point + torque about it . rate; contacts tell it one by one. Torques are
  // about where they are in the middle of the step, and power by what the material does half-way of it: that
  // differs by rate x way of a contact in half a step, at most.
  Scene scene = tumbler(false, 0.3, 0.5);
  for (Wall& wall : scene.setup.walls) wall.motion.pop_back();
  Experiment run(std::move(scene));
  const Vec3 omega = 1.3 * Vec3(1, 1, 1).normalized();
  double fastest_before = 2;  // [m/s]: more than they begin with
  for (int k = 0; k < 2000; ++k) {
    const double before = work_of(run);
    const double impulse_time = run.step().time_step;
    double power = 0;
    double pressed = 0, fastest = 0;
    for (const WallReport& wall : run.simulation().walls()) {
      power += wall.torque.dot(omega);
      pressed += wall.force.norm();
    }
    for (const Velocity& v : run.simulation().state().bodies.velocity)
      fastest = std::max(fastest, Eigen::Map<const Vec3>(v.u).norm());
    const double way = std::max(fastest, fastest_before) * h / 2;
    fastest_before = fastest;
    ASSERT_NEAR(work_of(run) - before, impulse_time * power,
                1e-15 + impulse_time * (1e-9 * std::abs(power) + omega.norm() * way * pressed));
  }
}

TEST(TiltedPlane, LetsABallGoAtTheAngleOfFriction) {
  const double mu = 0.3, rate = 0.5, reach = 0.2;
  Scene scene(h);
  scene.wall("table", Vec3::Zero(), Vec3::UnitZ()).motion = {
      rotation_part(Vec3::UnitY(), Vec3::Zero(), rate)};
  scene.stage().gravity = {0, 0, -g_earth};
  scene.friction(mu);
  scene.setup.rotation = false;
  scene.sphere({reach, 0, radius}, radius, 0.7, {0, 0, -reach * rate});
  Experiment run(std::move(scene));
  const double slides_at = std::atan(mu) / rate;
  const auto along = [&] {
    const double angle = rate * run.time();
    return run.x().dot(Vec3(std::cos(angle), 0, -std::sin(angle)));
  };
  const auto off = [&] {
    const double angle = rate * run.time();
    return run.x().dot(Vec3(std::sin(angle), 0, std::cos(angle)));
  };
  while (run.time() < 0.95 * slides_at) run.step();
  // What does not turn itself rolls back on the table that turns under it.
  EXPECT_NEAR(along(), reach - radius * rate * run.time(), 1e-4 * reach);
  EXPECT_NEAR(off(), radius, 1e-4 * radius);
  while (run.time() < 1.3 * slides_at) run.step();
  EXPECT_GT(along(), reach) << "slides down";
}

TEST(Motion, ThatSweepsPastABallFasterThanItsRadiusAStepIsSaid) {
  Scene scene(h);
  scene.surface("rectangle", {{"corner", {-1, -1, -0.5}}, {"edge_a", {2, 0, 0}}, {"edge_b", {0, 2, 0}}});
  scene.setup.walls.back().motion = {MotionPart{.velocity = {0, 0, 30}}};
  scene.stage().laws.set_all(&PairLaw::restitution, 0.5);  // what bounces is not held before it touches
  scene.sphere({0, 0, 0}, radius, 0.7);
  Experiment run(std::move(scene));
  std::int64_t passed = 0;
  for (int k = 0; k < 40; ++k) passed += run.step().passed;
  EXPECT_GT(passed, 0);
}

/// A plate behind a ball at rest that leaps to the other side of it between the middles of two steps, and
/// stands before and behind that.
TEST(Motion, ThatLeapsPastABallBetweenTheMiddlesOfStepsIsSaid) {
  for (const std::string shape : {"rectangle", "disc"})
    for (const bool elastic : {false, true}) {
      Scene scene(h);
      if (shape == "disc")
        scene.surface(shape, {{"centre", {-2 * radius, 0, 0}}, {"axis", {1, 0, 0}}, {"radius", {1}}});
      else
        scene.surface(shape,
                      {{"corner", {-2 * radius, -1, -1}}, {"edge_a", {0, 2, 0}}, {"edge_b", {0, 0, 2}}});
      MotionTable table{.t = {0, 0.01, 0.0105, 1}, .shift = {}, .velocity = {}, .angle = {}};
      for (const double x : {0.0, 0.0, 3 * radius, 3 * radius}) table.shift.emplace_back(x, 0, 0);
      scene.setup.walls.back().motion = {
          MotionPart{.kind = MotionPart::Kind::table, .table = std::make_shared<MotionTable>(table)}};
      scene.stage().laws.set_all(&PairLaw::restitution, elastic ? 1.0 : 0.5);
      scene.sphere({0, 0, 0}, radius, 0.7);
      Experiment run(std::move(scene));
      std::int64_t passed = 0;
      for (int k = 0; k < 14; ++k) passed += run.step().passed;
      EXPECT_EQ(run.u(), Vec3::Zero()) << "else it has not been passed";
      EXPECT_GT(passed, 0) << shape;
    }
}

/// The same where the last step was longer: its middle lies farther back than half of this one.
TEST(Motion, ThatLeapsPastABallAsTheTimeStepChangesIsSaid) {
  Scene scene(4 * h);
  scene.surface("disc", {{"centre", {-2 * radius, 0, 0}}, {"axis", {1, 0, 0}}, {"radius", {1}}});
  MotionTable table{.t = {0, 0.0103, 0.011, 1}, .shift = {}, .velocity = {}, .angle = {}};
  for (const double x : {0.0, 0.0, 3 * radius, 3 * radius}) table.shift.emplace_back(x, 0, 0);
  scene.setup.walls.back().motion = {
      MotionPart{.kind = MotionPart::Kind::table, .table = std::make_shared<MotionTable>(table)}};
  scene.stage().laws.set_all(&PairLaw::restitution, 0.5);
  scene.stage().end.steps = 3;  // the last one's middle is at 0.01 s
  scene.setup.stages.push_back(scene.setup.stages.back());
  scene.setup.stages.back().time_step = h;  // the first one's is at 0.0125 s
  scene.setup.stages.back().end.steps = 10;
  scene.sphere({0, 0, 0}, radius, 0.7);
  Experiment run(std::move(scene));
  std::int64_t passed = 0;
  for (int k = 0; k < 8; ++k) {
    passed += run.step().passed;
    run.next_stage();
  }
  EXPECT_EQ(run.u(), Vec3::Zero()) << "else it has not been passed";
  EXPECT_GT(passed, 0);
}

TEST(Motion, ChoosesTimeStepsThatFollowIt) {
  Scene scene(h);
  scene.wall("plate", Vec3::Zero(), Vec3::UnitZ()).motion = {oscillation_part(Vec3::UnitZ(), 1e-3, 40)};
  scene.stage().chooses_time_step = true;
  scene.stage().time_step = 0;
  scene.stage().time_step_max = 0.01;
  scene.stage().gravity = {0, 0, -g_earth};
  scene.sphere({0, 0, radius}, radius, 0.7);
  Experiment run(std::move(scene));
  for (int k = 0; k < 100; ++k) {
    const StepReport& step = run.step();
    EXPECT_LE(step.time_step, 1.0 / 40 / 20);
    EXPECT_LT(step.overlap, 0.05);
    EXPECT_EQ(step.passed, 0);
  }
}

}  // namespace
}  // namespace talus::validation::closed_form_motions_test
