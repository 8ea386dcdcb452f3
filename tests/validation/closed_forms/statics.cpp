/// Force balance: columns, pressed walls, wedges, and walls too heavy to be moved.

#include <gtest/gtest.h>

#include "tests/validation/experiment.hpp"

namespace talus::validation::closed_form_statics_test {
namespace {

constexpr double h = 1e-3, radius = 0.05, mass = 0.8;

void stack(Scene& scene, int count) {
  for (int k = 0; k < count; ++k) scene.sphere({0, 0, radius * (2 * k + 1)}, radius, mass);
}

TEST(Tower, FloorCarriesTheWholeWeightFromAColdStart) {
  for (double mu : {0.0, 0.35}) {
    const int count = 10;
    Scene scene(h);
    scene.slope(0);
    scene.friction(mu);
    scene.setup.solver.warm_start = false;
    scene.setup.solver.tolerance = 1e-9;
    stack(scene, count);
    Experiment run(std::move(scene));
    for (int k = 0; k < 20; ++k) {
      const StepReport& report = run.step();
      EXPECT_TRUE(report.converged);
      EXPECT_NEAR(run.wall_force(0)[2], count * mass * g_earth, 1e-5 * count * mass * g_earth)
          << "step " << k;
    }
    EXPECT_NEAR(run.x(count - 1)[2], radius * (2 * count - 1), 1e-6 * radius);
  }
}

TEST(Tower, EachContactCarriesWhatStandsOnIt) {
  const int count = 10;
  Scene scene(h);
  scene.slope(0);
  scene.friction(0.35);
  stack(scene, count);
  Experiment run(std::move(scene));
  run.steps(5);
  const Frame frame = run.simulation().frame();
  ASSERT_EQ(frame.contact_force.size(), static_cast<std::size_t>(count));
  for (std::size_t k = 0; k < frame.contact_force.size(); ++k) {
    const double below = frame.contact_point[k][2] / (2 * radius);  // grains below the contact
    const double above = count - std::round(below);
    EXPECT_NEAR(std::abs(frame.contact_force[k][2]), above * mass * g_earth, 1e-8) << below;
  }
}

/// Grains of which each rests on the four below it, between smooth planes: `layers` of `edge` x `edge` and of
/// (edge - 1) x (edge - 1) in turn. More than are solved directly.
Scene pyramids(int edge, int layers) {
  Scene scene(h);
  scene.slope(0);
  const double width = 2 * radius * edge;
  scene.wall("x-", Vec3::Zero(), Vec3::UnitX());
  scene.wall("x+", {width, 0, 0}, -Vec3::UnitX());
  scene.wall("y-", Vec3::Zero(), Vec3::UnitY());
  scene.wall("y+", {0, width, 0}, -Vec3::UnitY());
  for (int k = 0; k < layers; ++k)
    for (int i = 0; i < edge - k % 2; ++i)
      for (int j = 0; j < edge - k % 2; ++j)
        scene.sphere(radius * Vec3(2 * i + 1 + k % 2, 2 * j + 1 + k % 2, 1 + std::sqrt(2.0) * k), radius,
                     mass);
  scene.setup.solver.max_iterations = 20000;
  return scene;
}

// Contacts deep in a heap carry hundreds of times what moves it: small residuals there are large motions. The
// answer is rest.
TEST(Heap, ThatIsCertifiedHardlyMoves) {
  for (const double tolerance : {1e-2, 1e-3}) {
    Scene scene = pyramids(7, 16);
    scene.setup.solver.tolerance = scene.setup.solver.balance_tolerance = tolerance;
    const auto count = static_cast<double>(scene.bodies.size());
    Experiment run(std::move(scene));
    for (int step = 1; step <= 3; ++step) {
      EXPECT_TRUE(run.step().converged) << "step " << step;
      double sum = 0;
      for (const Velocity& v : run.simulation().state().bodies.velocity)
        sum += Vec3(v.u[0], v.u[1], v.u[2]).norm();
      EXPECT_LE(sum, 2 * tolerance * count * g_earth * h) << "step " << step;
      std::printf("step %d tol %g: %g its %d\n", step, tolerance, sum / (count * g_earth * h),
                  run.simulation().report().iterations);
    }
  }
}

// Each grain begins 1 % of its radius in the one below: that is undone, and is no motion.
TEST(Column, ComesToRestWhileItsOverlapsAreUndone) {
  const int count = 30;
  for (const double correction : {0.1, 0.5}) {
    Scene scene(h);
    scene.slope(0);
    scene.friction(0.35);
    scene.setup.solver.overlap_correction = correction;
    for (int k = 0; k < count; ++k) scene.sphere({0, 0, 0.99 * radius * (2 * k + 1)}, radius, mass);
    Experiment run(std::move(scene));
    run.steps(1);
    const double first = run.simulation().report().penetration_max;
    run.steps(400);
    EXPECT_LT(run.kinetic_energy(), 1e-12 * count * mass * g_earth * radius) << correction;
    EXPECT_LT(run.simulation().report().penetration_max, 0.1 * first) << correction;
    EXPECT_NEAR(run.wall_force(0)[2], count * mass * g_earth, 1e-8 * count * mass * g_earth) << correction;
    EXPECT_TRUE(run.simulation().report().converged) << correction;
  }
}

Scene pressed_column(int count, double pressure, double area, double wall_mass, double e) {
  Scene scene(h);
  scene.wall("floor", Vec3::Zero(), Vec3::UnitZ());
  scene.stage().laws.set_all(&PairLaw::restitution, e);
  scene.friction(0.3);
  stack(scene, count);
  Wall& lid = scene.wall("lid", {0, 0, 2 * radius * count + 0.001}, -Vec3::UnitZ());
  lid.area = area;
  lid.load = {.drive = WallDrive::pressure, .pressure = pressure, .mass = wall_mass};
  return scene;
}

TEST(PressedWall, ColumnCarriesPressureTimesArea) {
  const double pressure = 2e3, area = 0.3, force = pressure * area;
  for (int count : {1, 10}) {
    Experiment run(pressed_column(count, pressure, area, 5.0, 0));
    run.steps(200);
    EXPECT_TRUE(run.simulation().report().converged);
    EXPECT_NEAR(run.wall_force(0)[2], force, 1e-8 * force) << count;
    EXPECT_NEAR(run.wall_force(1)[2], -force, 1e-8 * force) << count;
    EXPECT_NEAR(run.simulation().walls()[1].position, -2 * radius * count, 1e-9) << "closed, not crushed";
    EXPECT_LE(run.simulation().report().penetration_max, 1e-9);
  }
}

TEST(PressedWall, ComesToRestOnABouncingColumn) {
  // With restitution an approach below twice what the load adds in a step is no impact: else the wall would
  // rattle for ever, one step in the air and one on the column.
  const double pressure = 2e3, area = 0.3, force = pressure * area;
  for (double e : {0.3, 0.8}) {
    Experiment run(pressed_column(3, pressure, area, 5.0, e));
    run.steps(3000);
    for (int k = 0; k < 20; ++k) {
      run.step();
      EXPECT_NEAR(run.wall_force(0)[2], force, 1e-6 * force) << "e = " << e;
      EXPECT_NEAR(run.wall_force(1)[2], -force, 1e-6 * force) << "e = " << e;
    }
  }
}

// What the planet presses with changes its speed by 1e-30 m/s, and sweeps would need 10^25 of them to tell:
// the certificate may refuse. Plain sweeps add nothing that is not asked for; momentum may leave a thousandth
// of the grain's weight between the two.
TEST(HeavyWall, PlanetPushedByATinyForceRestsOnAGrain) {
  for (const SolverMethod method : {SolverMethod::nlgs, SolverMethod::automatic}) {
    Scene scene(h);
    scene.setup.solver.method = method;
    scene.wall("floor", Vec3::Zero(), Vec3::UnitZ());
    scene.stage().gravity = {0, 0, -g_earth};
    scene.setup.solver.max_iterations = 200;
    stack(scene, 1);
    Wall& planet = scene.wall("planet", {0, 0, 2 * radius}, -Vec3::UnitZ());
    planet.load = {.drive = WallDrive::force, .force = 1e-3, .mass = 6e24};
    Experiment run(std::move(scene));
    run.steps(1000);
    EXPECT_NEAR(run.x()[2], radius, 1e-15);
    EXPECT_NEAR(run.simulation().walls()[1].position, -2 * radius, 1e-15);
    const double allowed = method == SolverMethod::nlgs ? 1e-9 : 2e-3 * mass * g_earth;
    EXPECT_NEAR(run.wall_force(0)[2], mass * g_earth, allowed);
  }
}

/// A moving planet drives a grain against the floor.
Scene moving_planet(SolverMethod method) {
  Scene scene(h);
  scene.wall("floor", Vec3::Zero(), Vec3::UnitZ());
  scene.setup.solver = {.tolerance = 1e-2, .balance_tolerance = 1e-2, .max_iterations = 2000};
  scene.setup.solver.method = method;
  // The grain's velocity is a difference of forces 10^20 times its weight: it may be anything, and its place.
  scene.setup.solver.overlap_tolerance = 1e300;
  stack(scene, 1);
  Wall& planet = scene.wall("planet", {0, 0, 2 * radius}, -Vec3::UnitZ());
  planet.velocity = {0, 0, -1e-3};
  planet.load = {.drive = WallDrive::force, .force = 1e-3, .mass = 6e24};
  return scene;
}

TEST(HeavyWall, CertificateRefusesAPlanetThatSweepsCannotStop) {
  // Sweeps pass on one grain mass at a time, so the natural map shrinks like 1/sweeps while the forces are
  // wrong by a factor of 10^20: the balance must refuse what the residual would accept.
  Experiment run(moving_planet(SolverMethod::nlgs));
  const StepReport& report = run.step();
  EXPECT_LE(report.error_rms, 1e-2);
  EXPECT_GT(report.balance, 0.1);
  EXPECT_FALSE(report.converged);
}

TEST(HeavyWall, MovingPlanetIsStoppedByAGrain) {
  Experiment run(moving_planet(SolverMethod::automatic));
  const StepReport& report = run.step();
  EXPECT_TRUE(report.converged);
  EXPECT_LE(std::abs(run.simulation().walls()[1].velocity), 1e-2 * 1e-3);
  EXPECT_NEAR(run.wall_force(0)[2], 6e24 * 1e-3 / h, 1e-2 * 6e24 * 1e-3 / h);
}

/// A sphere between two walls that meet at the origin in a line along y; each is `half_angle` from the
/// vertical.
Scene wedge(double half_angle, double mu) {
  Scene scene(h);
  const double c = std::cos(half_angle), s = std::sin(half_angle);
  scene.wall("left", Vec3::Zero(), {c, 0, s});
  scene.wall("right", Vec3::Zero(), {-c, 0, s});
  scene.stage().gravity = {0, 0, -g_earth};
  scene.friction(mu);
  scene.sphere({0, 0, radius / s}, radius, mass);
  return scene;
}

TEST(Wedge, WallsCarryTheWeightOfAJammedSphere) {
  for (double half_angle : {0.8, 0.3, 0.1}) {
    Experiment run(wedge(half_angle, 0));
    run.steps(100);
    EXPECT_TRUE(run.simulation().report().converged);
    const double force = mass * g_earth / (2 * std::sin(half_angle));
    for (std::size_t wall : {0u, 1u})
      EXPECT_NEAR(run.wall_force(wall).norm(), force, 1e-6 * force) << half_angle << ' ' << wall;
    EXPECT_LE(run.u().norm(), 1e-6 * h * g_earth) << half_angle;
  }
}

TEST(Wedge, ToleranceBelowRoundingEndsTheStepEarlyAndSaysSo) {
  Scene scene = wedge(0.1, 0.4);
  scene.setup.solver.tolerance = 1e-16;
  scene.setup.solver.max_iterations = 100000;
  Experiment run(std::move(scene));
  const StepReport& report = run.step();
  EXPECT_FALSE(report.converged);
  EXPECT_TRUE(run.simulation().iterations().stagnated);
  EXPECT_LT(report.iterations, 5000);
  EXPECT_LT(report.error_rms, 1e-11);
}

TEST(Wedge, WithFrictionTheForcesAreNotUniqueButTheirSumIs) {
  for (double half_angle : {0.8, 0.3, 0.1}) {
    Scene scene = wedge(half_angle, 0.4);
    scene.setup.solver.tolerance = 1e-11;  // forces of ten weights: rounding leaves 1.01e-12
    Experiment run(std::move(scene));
    run.steps(100);
    EXPECT_TRUE(run.simulation().report().converged);
    const Vec3 sum = run.wall_force(0) + run.wall_force(1);
    EXPECT_NEAR(sum[2], mass * g_earth, 1e-6 * mass * g_earth) << half_angle;
    EXPECT_NEAR(sum[0], 0, 1e-6 * mass * g_earth) << half_angle;
    EXPECT_LE((run.u() + run.w()).norm(), 1e-6 * h * g_earth) << half_angle;
    const Frame frame = run.simulation().frame();
    for (std::size_t k = 0; k < frame.contact_force.size(); ++k) {
      const double normal = frame.contact_force[k].dot(frame.contact_normal[k]);
      EXPECT_LE((frame.contact_force[k] - normal * frame.contact_normal[k]).norm(),
                0.4 * normal * (1 + 1e-12));
    }
  }
}

TEST(Wedge, SphereDrivenIntoItByAWallStops) {
  Scene scene = wedge(0.3, 0.2);
  const double top = radius / std::sin(0.3) + radius;
  Wall& lid = scene.wall("lid", {0, 0, top}, -Vec3::UnitZ());
  lid.load = {.drive = WallDrive::force, .force = 500, .mass = 2.0};
  scene.stage().laws.between(material_of_grains, material_of_walls).friction = 0;
  Experiment run(std::move(scene));
  run.steps(100);
  const double force = (500 + mass * g_earth) / (2 * std::sin(0.3));
  EXPECT_NEAR(run.wall_force(0).norm(), force, 1e-6 * force);
  EXPECT_NEAR(run.wall_force(1).norm(), force, 1e-6 * force);
  EXPECT_NEAR(run.simulation().walls()[2].position, -top, 1e-9);
}

}  // namespace
}  // namespace talus::validation::closed_form_statics_test
