// What passes by is not hit: the law of a step is linear about one normal, and where bodies go in the step
// that normal turns.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/validation/experiment.hpp"

namespace talus::validation::closed_form_passing_test {
namespace {

/// [m], [kg], [s]: at 0.5 m/s a step is a quarter of the radius.
constexpr double r = 1e-3, mass = 1.1e-5, quarter = 5e-4;

/// A ball that slides at 0.5 m/s on a plate, and where that ends over another one, higher by `step` [m].
Experiment over_plates(double step, double restitution, double start, bool clump) {
  Scene scene(quarter);
  scene.stage().gravity = {0, 0, -g_earth};
  scene.stage().laws.set_all(&PairLaw::restitution, restitution);
  scene.surface("rectangle", {{"corner", {-0.1, -0.1, 0}}, {"edge_a", {0.1, 0, 0}}, {"edge_b", {0, 0.2, 0}}});
  scene.surface("rectangle", {{"corner", {0, -0.1, step}}, {"edge_a", {0.3, 0, 0}}, {"edge_b", {0, 0.2, 0}}});
  const Vec3 x(start, 0, r), u(0.5, 0, 0);
  if (clump) {
    const Ball one[] = {{Vec3::Zero(), r}};
    scene.setup.clumps.push_back(make_clump(one).clump);
    add_clump(scene.bodies, scene.setup.clumps, 1, BodyId{0}, {x, {1, 0, 0, 0}, r, 2600, u, Vec3::Zero()});
  } else {
    scene.sphere(x, r, mass, u);
  }
  return Experiment(std::move(scene));
}

// It rose by five radii: its step took the edge ahead, which it passes above, for a wall that leans.
TEST(BallOverALowerPlate, PassesItsEdge) {
  for (const double down : {1e-6, 1e-5, 1e-3, 1e-2, 0.1})
    for (const double restitution : {0.0, 0.8})
      for (const bool clump : {false, true})
        for (const double start : {-0.0101, -0.0102, -0.0104, -0.0106}) {
          Experiment run = over_plates(-down * r, restitution, start, clump);
          double highest = 0;
          for (int step = 0; step < 100; ++step) {
            run.step();
            highest = std::max(highest, run.x()[2]);
          }
          EXPECT_LT(highest, r * (1 + 1e-9)) << down << ' ' << restitution << ' ' << start;
          EXPECT_NEAR(run.u()[0], 0.5, 1e-9) << down << ' ' << restitution << ' ' << start;
        }
}

// The edge of a plate that is higher by s r is met at the sine (2 s)^1/2, whatever the step.
TEST(BallOverAHigherPlate, IsLiftedByWhatItsEdgeStandsOut) {
  for (const double up : {1e-6, 1e-5, 1e-4})
    for (const double restitution : {0.0, 0.8})
      for (const double start : {-0.0101, -0.0102, -0.0104, -0.0106}) {
        Experiment run = over_plates(up * r, restitution, start, false);
        double fastest = 0;
        for (int step = 0; step < 100; ++step) {
          run.step();
          fastest = std::max(fastest, run.u()[2]);
        }
        const double lifted = (1 + restitution) * 0.5 * std::sqrt(2 * up);
        EXPECT_LT(fastest, 1.1 * lifted) << up << ' ' << restitution << ' ' << start;
      }
}

// One at rest got up to a quarter of the speed of another that passed it at a distance.
TEST(SpheresThatPass, LeaveOneAnotherAlone) {
  for (const double way : {0.02, 0.1, 0.25, 0.45})  // a step, over the radius
    for (const double miss : {1e-6, 1e-4, 1e-2})
      for (const double restitution : {0.0, 0.5, 1.0})
        for (const double phase : {0.0, 0.3, 0.6, 0.9}) {
          Scene scene(quarter);
          scene.stage().laws.set_all(&PairLaw::restitution, restitution);
          const Vec3 u(way * r / quarter, 0, 0);
          scene.sphere({-3 * r - phase * way * r, 2 * r * (1 + miss), 0}, r, mass, u);
          scene.sphere({0, 0, 0}, r, mass);
          Experiment run(std::move(scene));
          run.steps(static_cast<int>(7 / way));
          EXPECT_EQ(run.u(0), u) << way << ' ' << miss << ' ' << restitution << ' ' << phase;
          EXPECT_EQ(run.u(1), Vec3(Vec3::Zero()));
        }
}

}  // namespace
}  // namespace talus::validation::closed_form_passing_test
