/// The cone against a search over many points of it.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

#include "kernels/shapes/shape.hpp"

namespace talus {
namespace {

std::shared_ptr<const Surface> make(const std::map<std::string, std::vector<double>>& numbers) {
  return wall_shape("cone")->make({.number = numbers, .file = {}, .triangles = {}});
}

std::vector<SurfacePoint> touched(const Surface& surface, const Vec3& centre, double reach) {
  std::vector<SurfacePoint> points;
  surface.collide(centre, reach, points);
  return points;
}

TEST(Cone, FromInsideHasTheNormalOfItsSlope) {
  // 45 degrees, tip down.
  const auto cone = make({{"start", {0, 0, 0}},
                          {"end", {0, 0, 3}},
                          {"start_radius", {0}},
                          {"end_radius", {3}},
                          {"inside", {1}}});
  const SurfacePoint point = cone->at({0.5, 0, 1.5}, 0);
  EXPECT_NEAR(point.distance, std::sqrt(0.5), 1e-15);
  EXPECT_LT((point.normal - Vec3(-1, 0, 1) / std::sqrt(2.0)).norm(), 1e-12);
  EXPECT_EQ(touched(*cone, {0, 0, 1.5}, 1.1).size(), 3u);
}

/// Points all over a frustum, by height and angle.
double nearest_of_many(const Vec3& x, double r0, double r1, double length, bool shell) {
  double best = std::numeric_limits<double>::infinity();
  const auto look = [&](double radius, double z) {
    const double rho = std::hypot(x[0], x[1]);  // the nearest angle is that of x
    best = std::min(best, std::hypot(rho - radius, x[2] - z));
  };
  constexpr int n = 4000;
  for (int k = 0; k <= n; ++k) {
    const double part = static_cast<double>(k) / n;
    look(r0 + part * (r1 - r0), part * length);
    if (!shell) look(part * r0, 0), look(part * r1, length);
  }
  return best;
}

TEST(Cone, NearestPointsAreThoseOfASearch) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> number(-3, 3);
  for (const bool shell : {false, true})
    for (const auto& [r0, r1] : {std::pair{1.0, 2.0}, {0.0, 1.5}, {1.0, 0.0}}) {
      const auto cone = make({{"start", {0, 0, 0}},
                              {"end", {0, 0, 2}},
                              {"start_radius", {r0}},
                              {"end_radius", {r1}},
                              {"inside", {shell ? 1.0 : 0.0}}});
      for (int k = 0; k < 200; ++k) {
        const Vec3 x(number(random), number(random), number(random) + 1);
        EXPECT_NEAR(std::abs(cone->at(x, 0).distance), nearest_of_many(x, r0, r1, 2, shell), 1e-3)
            << x.transpose() << (shell ? " shell" : " solid");
        const Bounds box = cone->bounds();
        EXPECT_TRUE(box.near(x, std::abs(cone->at(x, 0).distance) + 1e-9)) << x.transpose();
      }
    }
}

TEST(Cone, CandidatesHoldEveryFeatureThatAMovedSphereTouches) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> number(-1, 1);
  const auto funnel = make({{"start", {0, 0, 0}},
                            {"end", {0, 0, 1}},
                            {"start_radius", {0.2}},
                            {"end_radius", {1}},
                            {"inside", {1}}});
  int several = 0;
  for (int k = 0; k < 20000; ++k) {
    const Vec3 x(0.5 * number(random), 0.5 * number(random), number(random));
    const double reach = 0.3 + 0.3 * std::abs(number(random)), way = 0.2 * std::abs(number(random));
    const Vec3 moved = x + way * Vec3(number(random), number(random), number(random)).normalized();
    std::vector<std::int32_t> near;
    funnel->near(x, reach, near);
    const auto points = touched(*funnel, moved, reach - way - 1e-12);
    several += points.size() > 1;
    for (const SurfacePoint& point : points)
      ASSERT_TRUE(std::ranges::find(near, point.feature) != near.end())
          << x.transpose() << " feature " << point.feature;
  }
  EXPECT_GT(several, 100);
}

TEST(Cone, WithoutARadiusIsRefused) {
  EXPECT_THROW(make({{"start", {0, 0, 0}}, {"end", {1, 0, 0}}, {"start_radius", {0}}, {"end_radius", {0}}}),
               std::invalid_argument);
}

}  // namespace
}  // namespace talus
