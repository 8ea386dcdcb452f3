/// A ball in a cone, and on its side.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/validation/experiment.hpp"

namespace talus::validation::closed_form_cone_test {
namespace {

constexpr double h = 1e-3, radius = 0.05, mass = 0.8;

/// Opens upwards from a tip at 0; `slope` is the angle of its side to the horizontal.
ShapeNumbers funnel(double slope) {
  const double height = 1, wide = height / std::tan(slope);
  return {{"start", {0, 0, 0}},
          {"end", {0, 0, height}},
          {"start_radius", {0}},
          {"end_radius", {wide}},
          {"inside", {1}}};
}

TEST(BallInACone, RestsOnItsAxisAtTheHeightOfTheTouchingCircle) {
  const double slope = pi / 3, height = radius / std::cos(slope);
  Scene scene(h);
  scene.stage().gravity = {0, 0, -g_earth};
  scene.surface("cone", funnel(slope));
  scene.sphere({0, 0, height}, radius, mass);
  Experiment run(std::move(scene));
  for (int k = 0; k < 200; ++k) {
    const StepReport& report = run.step();
    ASSERT_TRUE(report.converged) << "step " << k;
    EXPECT_NEAR(run.wall_force(0)[2], mass * g_earth, 1e-8) << "step " << k;
  }
  EXPECT_LT((run.x() - Vec3(0, 0, height)).norm(), 1e-7 * radius);
  EXPECT_LT(run.wall_force(0).head<2>().norm(), 1e-7);
  const Frame frame = run.simulation().frame();
  ASSERT_EQ(frame.contact_force.size(), 3u);
  // Each of three carries a third of the weight over the cosine of the slope.
  for (const Vec3& force : frame.contact_force)
    EXPECT_NEAR(force.norm(), mass * g_earth / (3 * std::cos(slope)), 1e-6);
}

TEST(BallInACone, SlidesDownItsSideAsDownAPlane) {
  const double slope = pi / 4;
  Scene scene(h);
  scene.stage().gravity = {0, 0, -g_earth};
  scene.surface("cone", funnel(slope));
  const Vec3 normal(-std::sin(slope), 0, std::cos(slope)), start = Vec3(0.5, 0, 0.5) + radius * normal;
  scene.sphere(start, radius, mass);
  Experiment run(std::move(scene));
  run.steps(100);
  const double t = 100 * h, way = 0.5 * g_earth * std::sin(slope) * t * t;
  const Vec3 down(-std::cos(slope), 0, -std::sin(slope));
  EXPECT_LT((run.x() - start - way * down).norm(), 1e-3 * way);
  EXPECT_NEAR(run.u().dot(down), g_earth * std::sin(slope) * t, 1e-9);
}

}  // namespace
}  // namespace talus::validation::closed_form_cone_test
