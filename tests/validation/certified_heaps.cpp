/// Heaps and vaults too large to be solved directly: what a certified step may be wrong by. Without friction
/// velocities are unique, and found by solving the step again from the same state nearly exactly; a vault
/// that stands has none.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/validation/experiment.hpp"

namespace talus::validation::certified_heaps_test {
namespace {

constexpr double h = 1e-3, radius = 0.05, mass = 0.8;

/// Smooth grains of 35 to 50 mm above a floor between planes, on a lattice that lets them fall apart.
Scene loose_grains(int edge, int layers) {
  Scene scene(h);
  scene.slope(0);
  const double spacing = 2.05 * radius;
  scene.wall("x-", Vec3::Zero(), Vec3::UnitX());
  scene.wall("x+", {edge * spacing, 0, 0}, -Vec3::UnitX());
  scene.wall("y-", Vec3::Zero(), Vec3::UnitY());
  scene.wall("y+", {0, edge * spacing, 0}, -Vec3::UnitY());
  unsigned random = 1;
  const auto some = [&](double most) {
    random = random * 1664525u + 1013904223u;
    return most * (random >> 8) / double{1u << 24};
  };
  for (int k = 0; k < edge * edge * layers; ++k) {
    const Vec3 site(k % edge + 0.5, k / edge % edge + 0.5, k / (edge * edge) + 0.5);
    const double r = radius * (1 - some(0.3));
    scene.sphere(spacing * site + radius * 0.02 * Vec3(some(1), some(1), some(1)), r,
                 mass * std::pow(r / radius, 3));
  }
  return scene;
}

Vec3 momentum_change(const Bodies& bodies, std::size_t slot, const Velocity& from) {
  const Velocity& v = bodies.velocity[slot];
  return Vec3(v.u[0] - from.u[0], v.u[1] - from.u[1], v.u[2] - from.u[2]) / v.inv_mass;
}

/// Of the grains at x > 0: sum m |u - u*| over sum m |u* - u_free| of one step from `before`.
double true_error(const Setup& setup, const Bodies& before, const Bodies& after) {
  Scene exact(h);
  exact.setup.walls = setup.walls;
  exact.setup.stages = setup.stages;
  exact.bodies = before;
  Experiment run(std::move(exact));
  run.step();
  const Bodies& answer = run.simulation().state().bodies;
  double error = 0, exchanged = 0;
  for (std::size_t s = 0; s < after.size(); ++s) {
    if (after.x[s][0] < 0) continue;
    const std::size_t a = run.slot(static_cast<std::int64_t>(after.id[s]));
    error += momentum_change(after, s, answer.velocity[a]).norm();
    Velocity free = before.velocity[static_cast<std::size_t>(std::ranges::find(before.id, after.id[s]) -
                                                             before.id.begin())];
    free.u[2] -= h * g_earth;
    exchanged += momentum_change(answer, a, free).norm();
  }
  return error / exchanged;
}

/// Grains that have come to rest with the impulses of the step before: residuals are small against the forces
/// deep in the heap from the first sweep on, and large against what a step's weight moves.
void expect_certified_velocities(Scene scene, double tolerance) {
  scene.setup.solver.tolerance = scene.setup.solver.balance_tolerance = tolerance;
  const Setup setup = scene.setup;
  Experiment run(std::move(scene));
  run.steps(699);
  for (int k = 700; k <= 1000; ++k) {
    const Bodies before = run.simulation().state().bodies;
    const StepReport& report = run.step();
    if (k % 50 != 0) continue;
    ASSERT_TRUE(report.converged) << "step " << k;
    EXPECT_LE(true_error(setup, before, run.simulation().state().bodies),
              2 * std::max({tolerance, report.error_rms, report.balance}))
        << "step " << k << " at " << tolerance;
  }
}

TEST(LargeHeap, OfSmoothGrainsHasTheVelocitiesThatItIsCertifiedToHave) {
  for (const double tolerance : {1e-2, 1e-3}) expect_certified_velocities(loose_grains(7, 13), tolerance);
}

// What carries a boulder elsewhere must not hide what the heap lacks.
TEST(LargeHeap, BesideABoulderIsJudgedByItself) {
  Scene scene = loose_grains(7, 13);
  std::erase_if(scene.setup.walls, [](const Wall& wall) { return wall.name == "x-"; });
  scene.surface("rectangle", {{"corner", {0, -1, -1}}, {"edge_a", {0, 3, 0}}, {"edge_b", {0, 0, 5}}});
  scene.sphere({-1, 0.36, 0.3}, 0.3, 1e6 * mass);
  expect_certified_velocities(std::move(scene), 1e-2);
}

// Nor what a lift gives to another heap as large: the fastest wall is not theirs.
TEST(LargeHeap, BesideOneThatIsLiftedIsJudgedByItself) {
  Scene scene = loose_grains(7, 13);
  const double apart = 0.2, far = apart + 7 * 2.05 * radius;
  std::erase_if(scene.setup.walls, [](const Wall& wall) { return wall.name == "x-"; });
  scene.wall("far", {-far, 0, 0}, Vec3::UnitX());
  for (const double x : {0.0, -apart})
    scene.surface("rectangle", {{"corner", {x, -1, -1}}, {"edge_a", {0, 3, 0}}, {"edge_b", {0, 0, 5}}});
  scene.surface("rectangle", {{"corner", {-2, -1, 0}}, {"edge_a", {2 - apart, 0, 0}}, {"edge_b", {0, 3, 0}}});
  scene.setup.walls.back().name = "lift";
  scene.setup.walls.back().motion = {MotionPart{.velocity = {0, 0, 0.5}}};
  for (const Scene other = loose_grains(7, 13); const Vec3& x : other.bodies.x) {
    const std::size_t slot = scene.bodies.size() - other.bodies.size();
    scene.sphere(x + Vec3(-far, 0, 0.06), other.bodies.radius[slot], other.bodies.mass(slot));
  }
  expect_certified_velocities(std::move(scene), 1e-2);
}

/// Rows of grains with friction side by side, each an arch of half angle `angle` between walls that its
/// thrust meets at a right angle.
Scene vault(int span, int rows, double angle) {
  Scene scene(h);
  scene.friction(0.3);
  scene.stage().gravity = -g_earth * Vec3::UnitZ();
  const double between = 2 * angle / (span - 1), r = radius / std::sin(between / 2);
  const auto site = [&](int k) {
    const double at = k * between - angle;
    return Vec3(r * std::sin(at), 0, r * (std::cos(at) - std::cos(angle)));
  };
  const double thrust = angle + between / 2;
  const Vec3 left(std::cos(thrust), 0, std::sin(thrust)), right(-left[0], 0, left[2]);
  scene.wall("left", site(0) - radius * left, left);
  scene.wall("right", site(span - 1) - radius * right, right);
  scene.wall("front", Vec3::Zero(), Vec3::UnitY());
  scene.wall("back", {0, 2 * radius * rows, 0}, -Vec3::UnitY());
  for (int j = 0; j < rows; ++j)
    for (int k = 0; k < span; ++k) scene.sphere(site(k) + Vec3(0, (2 * j + 1) * radius, 0), radius, mass);
  scene.setup.solver.tolerance = 1e-3;
  scene.setup.solver.balance_tolerance = 0.05;
  scene.setup.solver.max_iterations = 2000;
  scene.setup.solver.overlap_tolerance = 10;
  return scene;
}

/// Of six steps, how many were certified; each moves at most by twice what it claims.
int standing_steps(double angle) {
  Experiment run(vault(9, 30, angle));
  int certified = 0;
  for (int k = 1; k <= 6; ++k) {
    const Bodies before = run.simulation().state().bodies;
    const StepReport& report = run.step();
    double moved = 0, given = 0;
    for (const Velocity& v : run.simulation().state().bodies.velocity)
      moved += Vec3(v.u[0], v.u[1], v.u[2]).norm() / v.inv_mass;
    for (const Velocity& v : before.velocity)
      given += Vec3(v.u[0], v.u[1], v.u[2] - h * g_earth).norm() / v.inv_mass;
    if (!report.converged) continue;
    ++certified;
    EXPECT_LE(moved / given, 2 * std::max({1e-3, report.error_rms, report.balance, report.velocity_error}))
        << "step " << k << ", angle " << angle;
  }
  return certified;
}

// The flatter, the more thrust must build up before anything rests on the walls: a few sweeps let a flat one
// fall, and every contact is nearly right then.
TEST(LargeVault, WithFrictionMovesNoMoreThanItIsCertifiedTo) {
  standing_steps(0.003);
  EXPECT_GT(standing_steps(0.1), 0) << "not all is missed";
  EXPECT_EQ(standing_steps(0.8), 6) << "a steep one stands";
}

/// A grain of a milligram that two balls of a kilogram jam against two walls, with friction: what the law
/// finds wrong with it, 0.035 m/s, is next to nothing in momentum, and the balls press it by 19 N. With 10^-4
/// N for that a step was certified.
Scene jammed_milligram(double tolerance) {
  Scene scene(1e-3);
  scene.stage().gravity = {0, 0, -g_earth};
  scene.friction(1);
  scene.setup.solver.tolerance = scene.setup.solver.balance_tolerance = tolerance;
  scene.setup.solver.max_iterations = 2000;
  scene.setup.solver.check_every = 10;
  scene.setup.decomposition.subdomains = 7;
  scene.setup.decomposition.coupling = Coupling::nscdd;
  scene.wall("z-", Vec3::Zero(), Vec3::UnitZ());
  scene.wall("x-", Vec3::Zero(), Vec3::UnitX());
  scene.wall("x+", {0.0305, 0, 0}, -Vec3::UnitX());
  scene.wall("y-", Vec3::Zero(), Vec3::UnitY());
  scene.wall("y+", {0, 0.0215, 0}, -Vec3::UnitY());
  scene.sphere({0.012629615983944355, 0.018182450071745078, 0.002000001}, 0.002, 1,
               {-0.001081041033753831, 0.00410932951272442, -0.07874863801712938});
  scene.sphere({0.019628962009276, 0.010822182192810658, 0.010000001}, 0.01, 1,
               {0.07889274131348004, -0.04925225628589036, -0.04673269524378051});
  scene.sphere({0.010107427097167842, 0.010055127078382416, 0.027571342283795514}, 0.01, 1e-6,
               {0.09656678590121039, -0.037755802493839856, 0.052821658624758884});
  scene.sphere({0.020439409797761127, 0.010834321138766324, 0.04467815450304101}, 0.01, 1,
               {0.174682538593797, -0.05920990636844808, -0.23743053558612154});
  return scene;
}

TEST(CertifiedSteps, OfAGrainThatHeavyBallsJamKnowWhatItBears) {
  Experiment coarse(jammed_milligram(1e-2)), fine(jammed_milligram(1e-6));
  EXPECT_TRUE(coarse.step().converged);
  EXPECT_TRUE(fine.step().converged);
  double largest = 0, wrong = 0;
  for (int wall = 0; wall < 5; ++wall) {
    largest = std::max(largest, fine.wall_force(wall).norm());
    wrong = std::max(wrong, (coarse.wall_force(wall) - fine.wall_force(wall)).norm());
  }
  EXPECT_GT(fine.wall_force(3).norm(), 10) << "of the milligram alone";
  EXPECT_LT(wrong, 1e-2 * largest);
}

// Friction keeps it jammed: each wall bears 10⁵ times its weight from then on, and of so much next to nothing
// lifted the ball in the step behind its landing, against gravity.
TEST(CertifiedSteps, OfABallThatLandedInANarrowWedgeLeaveItAtRest) {
  constexpr double half_angle = 0.005, step = 1e-5;
  for (const double friction : {0.05, 0.5}) {
    Scene scene(step);
    scene.stage().gravity = {0, 0, -g_earth};
    scene.friction(friction);
    scene.setup.solver.tolerance = scene.setup.solver.balance_tolerance = 1e-3;
    scene.setup.solver.check_every = 10;
    scene.wall("left", Vec3::Zero(), {std::cos(half_angle), 0, std::sin(half_angle)});
    scene.wall("right", Vec3::Zero(), {-std::cos(half_angle), 0, std::sin(half_angle)});
    scene.sphere({0, 0, radius / std::sin(half_angle)}, radius, 1.36, {0, 0, -10});
    Experiment run(std::move(scene));
    ASSERT_TRUE(run.step().converged) << "it lands";
    for (int k = 2; k <= 6; ++k) {
      ASSERT_TRUE(run.step().converged) << "step " << k;
      const Velocity& v = run.simulation().state().bodies.velocity[0];
      EXPECT_LT(Vec3(v.u[0], v.u[1], v.u[2]).norm(), 2e-3 * step * g_earth)
          << "step " << k << ", friction " << friction;
    }
  }
}

}  // namespace
}  // namespace talus::validation::certified_heaps_test
