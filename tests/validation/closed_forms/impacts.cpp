/// Impacts of one and two spheres, and what they keep.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <vector>

#include "tests/validation/experiment.hpp"

namespace talus::validation::closed_form_impacts_test {
namespace {

/// A sphere about to meet the floor with (v_t, -v_n), without gravity.
Scene oblique(double v_t, double v_n, double mu, double e) {
  Scene scene(1e-3);
  scene.wall("floor", Vec3::Zero(), Vec3::UnitZ());
  scene.friction(mu);
  scene.stage().laws.set_all(&PairLaw::restitution, e);
  scene.sphere({0, 0, 0.1 + 0.0137 * v_n}, 0.1, 0.7, {v_t, 0, -v_n});
  return scene;
}

/// Where it sticks the surface's speed goes from v_t to -e_t v_t: e_t is 0 with Newton's law, e with
/// Moreau's.
void expect_oblique_impacts(RestitutionLaw law) {
  const double v_n = 2;
  for (double mu : {0.1, 0.3, 0.6})
    for (double e : {0.0, 0.3, 0.9}) {
      const double e_t = law == RestitutionLaw::moreau ? e : 0, limit = 3.5 * mu * (1 + e) / (1 + e_t) * v_n;
      for (double v_t : {0.0, 0.5 * limit, 0.999 * limit, 1.001 * limit, 3 * limit}) {
        Scene scene = oblique(v_t, v_n, mu, e);
        scene.setup.solver.restitution_law = law;
        Experiment run(std::move(scene));
        run.steps(40);
        const bool sticks = v_t <= limit;
        const double after = v_t - (sticks ? 2 * (1 + e_t) * v_t / 7 : mu * (1 + e) * v_n);
        EXPECT_NEAR(run.u()[0], after, 1e-11) << mu << ' ' << e << ' ' << v_t;
        EXPECT_NEAR(run.w()[1], 2.5 * (v_t - after), 1e-11) << mu << ' ' << e << ' ' << v_t;
        EXPECT_NEAR(run.u()[2], e * v_n, 1e-11) << mu << ' ' << e << ' ' << v_t;
      }
    }
}

TEST(ObliqueImpact, SticksWhereFrictionSufficesAndSlidesElsewhere) {
  expect_oblique_impacts(RestitutionLaw::moreau);
}

TEST(ObliqueImpact, StopsWhatSticksWithNewtonsLaw) {
  expect_oblique_impacts(RestitutionLaw::newton);
}

/// Three equal spheres in line, the first of which moves; gaps that it crosses within a tenth of a step.
std::vector<double> speeds_of_struck_row(double second_speed) {
  Scene scene(1e-4);
  scene.friction(0);
  scene.stage().laws.set_all(&PairLaw::restitution, 1);
  for (const int k : {0, 1, 2})
    scene.sphere({0.20001 * k, 0, 0}, 0.1, 1.0, {k == 0 ? 1.0 : k == 1 ? second_speed : 0.0, 0, 0});
  Experiment run(std::move(scene));
  run.steps(20);
  return {run.u(0)[0], run.u(1)[0], run.u(2)[0]};
}

// An elastic impact that goes on to a sphere which rests has to leave it in the next step as it would one
// that moves by rounding.
TEST(ElasticImpact, PassesThroughSpheresAtRestWithoutLoss) {
  for (const double second : {0.0, 1e-12}) {
    const std::vector<double> u = speeds_of_struck_row(second);
    EXPECT_NEAR(u[0], 0, 1e-11) << second;
    EXPECT_NEAR(u[1], 0, 1e-11) << second;
    EXPECT_NEAR(u[2], 1, 1e-11) << second;
  }
}

struct Bounces {
  std::vector<double> speed_ratios;  ///< after over before, per impact on the floor
  std::vector<double> heights;       ///< of the centre above rest at its highest, per flight
  double stopped_at = 0;             ///< first time after which it does not move [s]
};

Bounces bounce(double height, double e, double time_step, double until) {
  Scene scene(time_step);
  scene.slope(0);
  scene.stage().laws.set_all(&PairLaw::restitution, e);
  scene.sphere({0, 0, 0.1 + height}, 0.1, 1.0);
  Experiment run(std::move(scene));
  Bounces out;
  double highest = 0, before = 0;
  while (run.time() < until) {
    run.step();
    const double now = run.u()[2];
    if (now > 1e-9 && before < -1e-9) {  // [m/s]: rest is known to rounding
      out.speed_ratios.push_back(-now / before);
      highest = 0;
    }
    highest = std::max(highest, run.x()[2] - 0.1);
    if (now <= 0 && before > 0) out.heights.push_back(highest);
    if (std::abs(now) > 1e-9) out.stopped_at = run.time();
    before = now;
  }
  return out;
}

TEST(BouncingBall, SpeedIsMultipliedByRestitutionAtEachImpact) {
  // Newton's law compares the end of the step with its beginning; gravity's h g must not slip into it, or an
  // elastic ball climbs.
  for (double e : {0.5, 0.8, 1.0}) {
    const Bounces found = bounce(0.5, e, 1e-3, 1.0);
    ASSERT_GE(found.speed_ratios.size(), 1u);
    for (double ratio : found.speed_ratios) EXPECT_NEAR(ratio, e, 1e-12) << "e = " << e;
  }
}

TEST(BouncingBall, ReboundHeightsFallWithTheSquareOfRestitution) {
  const double e = 0.8, height = 0.5, h = 1e-4;
  const Bounces found = bounce(height, e, h, 3.5);
  ASSERT_GE(found.heights.size(), 5u);
  double expected = height;
  for (std::size_t k = 0; k < 5; ++k) {
    expected *= e * e;
    // Each impact is met up to one step late: the height is off by up to h v per impact.
    EXPECT_NEAR(found.heights[k], expected,
                static_cast<double>(k + 1) * 2 * h * std::sqrt(2 * g_earth * height));
  }
}

TEST(BouncingBall, StopsAfterTheSumOfItsFlights) {
  const double height = 0.5;
  for (double e : {0.3, 0.6, 0.8}) {
    const double stop = std::sqrt(2 * height / g_earth) * (1 + e) / (1 - e);
    for (double h : {1e-3, 2.5e-4}) {
      const Bounces found = bounce(height, e, h, 1.3 * stop);
      // Impacts slower than 2 h g do not bounce any more: of the series, a few steps are missing. And the
      // ball turns up to h v above the floor, which makes flights longer.
      EXPECT_NEAR(found.stopped_at, stop, 15 * h / (1 - e)) << "e = " << e << ", h = " << h;
    }
  }
}

TEST(BouncingBall, ElasticBallKeepsItsEnergy) {
  Scene scene(1e-3);
  scene.slope(0);
  scene.stage().laws.set_all(&PairLaw::restitution, 1);
  scene.sphere({0, 0, 0.1 + 0.5}, 0.1, 1.0);
  Experiment run(std::move(scene));
  const double before = run.mechanical_energy();
  run.steps(20000);
  EXPECT_NEAR(run.mechanical_energy(), before, 1e-10 * before);
}

/// Two spheres of different size, spinning, that would touch after `head_start` steps; at 1/2 they touch
/// where the first step detects.

Scene two_spheres(double e, double mu, double head_start) {
  const double h = 1e-3, r_0 = 0.1, r_1 = 0.17;
  const Vec3 n = Vec3(0.8, 0.5, -0.3).normalized(), u_0(-1.1, 0.2, 0.4), u_1(0.9, -0.3, 0.1);
  Scene scene(h);
  scene.friction(mu);
  scene.stage().laws.set_all(&PairLaw::restitution, e);
  const Vec3 x_1(0.3, -0.2, 0.05), x_0 = x_1 + (r_0 + r_1) * n;
  scene.sphere(x_0 - head_start * h * u_0, r_0, 0.5, u_0).w[2] = 0.7;
  scene.sphere(x_1 - head_start * h * u_1, r_1, 1.3, u_1).w[0] = -0.4;
  return scene;
}

Vec3 sphere_momentum(const Experiment& run) {
  const Bodies& bodies = run.simulation().state().bodies;
  Vec3 sum = Vec3::Zero();
  for (std::size_t s = 0; s < bodies.size(); ++s)
    sum += bodies.mass(s) * Eigen::Map<const Vec3>(bodies.velocity[s].u);
  return sum;
}

/// About the origin; I omega = w R / (R^2/I).
Vec3 sphere_angular_momentum(const Experiment& run) {
  const Bodies& bodies = run.simulation().state().bodies;
  Vec3 sum = Vec3::Zero();
  for (std::size_t s = 0; s < bodies.size(); ++s) {
    const Velocity& v = bodies.velocity[s];
    sum += bodies.mass(s) * bodies.x[s].cross(Eigen::Map<const Vec3>(v.u)) +
           bodies.radius[s] / v.spin_mobility * Eigen::Map<const Vec3>(v.w);
  }
  return sum;
}

TEST(TwoSpheres, ObliqueCollisionKeepsMomentumAndAngularMomentum) {
  for (double e : {0.0, 0.5, 1.0})
    for (double mu : {0.0, 0.2, 5.0}) {
      Experiment run(two_spheres(e, mu, 0.5));
      const Vec3 p = sphere_momentum(run), l = sphere_angular_momentum(run);
      const double energy = run.kinetic_energy();
      run.steps(20);
      EXPECT_GT((run.u(0) - Vec3(-1.1, 0.2, 0.4)).norm(), 0.1) << "they met";
      EXPECT_LE((sphere_momentum(run) - p).norm(), 32 * epsilon * 2) << e << ' ' << mu;
      EXPECT_LE((sphere_angular_momentum(run) - l).norm(), 64 * epsilon) << e << ' ' << mu;
      EXPECT_LE(run.kinetic_energy(), energy * (1 + 8 * epsilon)) << e << ' ' << mu;
      if (e == 1 && mu == 0) {
        EXPECT_NEAR(run.kinetic_energy(), energy, 16 * epsilon * energy);
      }
    }
}

TEST(TwoSpheres, GapAtDetectionCostsAtMostItselfTimesTheFriction) {
  // The lever of a contact is R, not R + gap/2: angular momentum is off by gap x r_t and falls with h.
  for (double head_start : {0.6, 1.3, 1.9}) {
    Experiment run(two_spheres(0, 0.2, head_start));
    const Vec3 p = sphere_momentum(run), l = sphere_angular_momentum(run);
    const Vec3 closing = run.u(0) - run.u(1);
    run.steps(20);
    const double impulse = 0.5 * (run.u(0) - Vec3(-1.1, 0.2, 0.4)).norm();
    EXPECT_LE((sphere_momentum(run) - p).norm(), 64 * epsilon);
    EXPECT_LE((sphere_angular_momentum(run) - l).norm(), 1e-3 * closing.norm() * impulse) << head_start;
  }
}

TEST(TwoSpheres, NormalImpactFollowsNewtonsLaw) {
  const double m_0 = 0.5, m_1 = 2.0, u_0 = 1.5, u_1 = -0.5;
  for (double e : {0.0, 0.4, 1.0}) {
    Scene scene(1e-3);
    scene.stage().laws.set_all(&PairLaw::restitution, e);
    scene.sphere({0, 0, 0}, 0.1, m_0, {u_0, 0, 0});
    scene.sphere({0.23, 0, 0}, 0.1, m_1, {u_1, 0, 0});
    Experiment run(std::move(scene));
    run.steps(100);
    const double centre = (m_0 * u_0 + m_1 * u_1) / (m_0 + m_1);
    EXPECT_NEAR(run.u(0)[0], centre - e * m_1 / (m_0 + m_1) * (u_0 - u_1), 1e-14);
    EXPECT_NEAR(run.u(1)[0], centre + e * m_0 / (m_0 + m_1) * (u_0 - u_1), 1e-14);
  }
}

/// A sphere flies past another, wherever the steps cut its path: where the two would come deeper into one
/// another than a step may let them, they meet, or the step was too long and says so.
TEST(TwoSpheres, ThatFlyThroughOneAnotherInAStepAreTold) {
  constexpr double radius = 0.1;
  int flown = 0;
  for (const double e : {0.0, 0.5, 0.9})
    for (const double far : {2.0, 3.5, 5.0})
      for (const double beside : {0.4, 1.2, 1.6, 1.8, 1.9, 2.05})
        for (int cut = 0; cut < 8; ++cut) {
          const double way = far * radius;
          Scene scene(1);
          scene.stage().laws.set_all(&PairLaw::restitution, e);
          scene.sphere({-(3 + cut / 8.0) * way, beside * radius, 0}, radius, 1, {way, 0, 0});
          scene.sphere({0, 0, 0}, radius, 1);
          Experiment run(std::move(scene));
          std::int64_t passed = 0;
          for (int k = 0; k < 8; ++k) passed += run.step().passed;
          const bool flew_on = run.u()[0] == way;
          if (flew_on && beside < 1.95) ++flown;
          if (flew_on) {
            EXPECT_EQ(passed > 0, beside < 1.95) << e << " " << far << " " << beside << " " << cut;
          }
        }
  EXPECT_GT(flown, 20) << "else nothing is looked at here";
}

/// A pair that closes from far off may be deep in one another by when the impact turns it: it has not passed.
TEST(TwoSpheres, ThatReboundHeadOnHaveNotPassed) {
  for (const double far : {0.6, 0.8, 0.95})
    for (int cut = 0; cut < 20; ++cut) {
      const double radius = 0.1, way = far * radius;
      Scene scene(1);
      scene.stage().laws.set_all(&PairLaw::restitution, 0.5);
      scene.sphere({-2 * radius - (3 + cut / 20.0) * way, 0, 0}, radius, 1, {way, 0, 0});
      scene.sphere({0, 0, 0}, radius, 1);
      Experiment run(std::move(scene));
      std::int64_t passed = 0;
      for (int k = 0; k < 12; ++k) passed += run.step().passed;
      EXPECT_EQ(passed, 0) << far << ' ' << cut;
      EXPECT_NEAR(run.u(1)[0], 0.75 * way, 1e-12) << far << ' ' << cut;
    }
}

TEST(ThreeSpheres, PushingASeparatingNeighbourGivesNoEnergy) {
  // A meets B while C, in contact with B, already moves away more slowly than B will. If C's contact were
  // closed with restitution 0 and A's with e, energy would be created: (A, B, C) = (1, 0, 1/2) ends with
  // 17/12 of 1/2 m v^2 at e = 1, where it began with 5/4.
  for (double e : {0.5, 0.9, 1.0}) {
    Scene scene(1e-3);
    scene.stage().laws.set_all(&PairLaw::restitution, e);
    scene.sphere({-0.2, 0, 0}, 0.1, 1.0, {1, 0, 0});
    scene.sphere({0, 0, 0}, 0.1, 1.0);
    scene.sphere({0.2 - 4e-4, 0, 0}, 0.1, 1.0, {0.5, 0, 0});
    Experiment run(std::move(scene));
    double energy = run.kinetic_energy();
    for (int k = 0; k < 50; ++k) {
      run.step();
      EXPECT_LE(run.kinetic_energy(), energy * (1 + 1e-12)) << "e = " << e << ", step " << k;
      energy = run.kinetic_energy();
    }
  }
}

}  // namespace
}  // namespace talus::validation::closed_form_impacts_test
