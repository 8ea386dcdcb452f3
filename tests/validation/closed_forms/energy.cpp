/// Energy and momentum of many grains in a closed box.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include "tests/validation/experiment.hpp"

namespace talus::validation::closed_form_energy_test {
namespace {

constexpr double h = 1e-3, edge = 1.0;

double uniform(std::mt19937_64& random, double from, double to) {
  return from + (to - from) * static_cast<double>(random() >> 11) * 0x1p-53;
}

/// 343 spheres of two sizes in a box, with random velocities of about 1 m/s and spins.
Scene gas(double e, double mu, const Vec3& gravity) {
  Scene scene(h);
  scene.stage().laws.set_all(&PairLaw::restitution, e);
  scene.friction(mu);
  scene.stage().gravity = gravity;
  // Frictional clusters do not always admit more (Renouf and Alart 2004; docs/theory.md, "Error"), and forces
  // between walls are not unique: a cluster can shift them while its velocities stand.
  scene.setup.solver.tolerance = 1e-9;
  scene.setup.solver.balance_tolerance = 1e-2;
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3 n = Vec3::Unit(axis);
    scene.wall("low" + std::to_string(axis), Vec3::Zero(), n);
    scene.wall("high" + std::to_string(axis), edge * n, -n);
  }
  std::mt19937_64 random(7);
  const int side = 7;
  for (int k = 0; k < side * side * side; ++k) {
    const Vec3 centre =
        (Vec3(k % side, k / side % side, k / side / side) + Vec3::Constant(0.5)) * edge / side;
    const double radius = k % 2 == 0 ? 0.068 : 0.05;
    const auto any = [&] { return uniform(random, -1, 1); };
    const Vec3 u(any(), any(), any());
    Velocity& v = scene.sphere(centre, radius, 1000 * radius * radius * radius, u);
    for (double& w : v.w) w = any();
  }
  return scene;
}

TEST(Energy, NeverGrowsInABoxOfInelasticGrains) {
  for (double e : {0.0, 0.3, 0.7})
    for (double mu : {0.0, 0.3}) {
      Experiment run(gas(e, mu, Vec3::Zero()));
      double energy = run.kinetic_energy();
      const double first = energy;
      for (int k = 0; k < 300; ++k) {
        const StepReport& report = run.step();
        // Now and then a cluster admits no more than some 1e-8.
        ASSERT_LT(report.error_rms, 1e-7)
            << "e = " << e << ", mu = " << mu << ", step " << k << " it " << report.iterations;
        const double now = run.kinetic_energy();
        EXPECT_LE(now, energy * (1 + 1e-10 + report.error_rms))
            << "e = " << e << ", mu = " << mu << ", step " << k;
        energy = now;
      }
      EXPECT_LT(energy, 0.6 * first) << "they did collide";
    }
}

TEST(Energy, IsKeptByElasticGrainsWithoutFriction) {
  // Moreau's law with one e for all contacts of a step is exactly elastic at e = 1.
  Experiment run(gas(1, 0, Vec3::Zero()));
  const double first = run.kinetic_energy();
  run.steps(300);
  EXPECT_NEAR(run.kinetic_energy(), first, 1e-8 * first);
}

TEST(Energy, OfMotionAndHeightNeverGrowsUnderGravity) {
  // The theta-scheme integrates gravity exactly; the gap term may lift a grain by what it falls in a step, up
  // to m (h g)^2 / 8 per grain and step.
  for (double e : {0.0, 0.5}) {
    Scene scene = gas(e, 0.3, {0, 0, -g_earth});
    scene.setup.solver = {.tolerance = 1e-5, .balance_tolerance = 1e-2, .max_iterations = 500};
    Experiment run(std::move(scene));
    const Bodies& bodies = run.simulation().state().bodies;
    double mass = 0;
    for (std::size_t s = 0; s < bodies.size(); ++s) mass += bodies.mass(s);
    double energy = run.mechanical_energy();
    for (int k = 0; k < 400; ++k) {
      run.step();
      const double now = run.mechanical_energy();
      EXPECT_LE(now, energy + mass * h * h * g_earth * g_earth / 8) << "e = " << e << ", step " << k;
      energy = now;
    }
  }
}

TEST(Momentum, OfACloudIsKeptWhenItsGrainsCollide) {
  for (double mu : {0.0, 0.4}) {
    Scene scene = gas(0.2, mu, Vec3::Zero());
    scene.setup.walls.clear();
    Bodies& bodies = scene.bodies;
    const Vec3 centre = Vec3::Constant(0.5 * edge);
    for (std::size_t s = 0; s < bodies.size(); ++s) {  // an implosion
      const Vec3 inward = centre - bodies.x[s];
      for (int axis = 0; axis < 3; ++axis) bodies.velocity[s].u[axis] += 2 * inward[axis];
    }
    const auto momentum = [](const Bodies& all) {
      Vec3 sum = Vec3::Zero();
      for (std::size_t s = 0; s < all.size(); ++s)
        sum += all.mass(s) * Eigen::Map<const Vec3>(all.velocity[s].u);
      return sum;
    };
    double scale = 0;
    for (std::size_t s = 0; s < bodies.size(); ++s)
      scale += bodies.mass(s) * Eigen::Map<const Vec3>(bodies.velocity[s].u).norm();
    const Vec3 before = momentum(bodies);
    Experiment run(std::move(scene));
    std::int64_t active = 0;
    for (int k = 0; k < 150; ++k) active += run.step().active;
    EXPECT_GT(active, 1000);
    EXPECT_LE((momentum(run.simulation().state().bodies) - before).norm(), 1e3 * epsilon * scale);
  }
}

}  // namespace
}  // namespace talus::validation::closed_form_energy_test
