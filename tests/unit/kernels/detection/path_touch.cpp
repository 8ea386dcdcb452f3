// By which gap and normal a step judges what bends on its way, against places looked for along the way.

#include "kernels/detection/detail/path_touch.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "kernels/detection/detail/pair_path.hpp"
#include "tests/unit/mesh_makers.hpp"

namespace talus::path_touch_test {
namespace {

using Random = std::mt19937_64;
double uniform(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}
Vec3 any_direction(Random& random) {
  std::normal_distribution<double> normal;
  return Vec3(normal(random), normal(random), normal(random)).normalized();
}
Space<double> space(const Vec3& v) {
  return {v[0], v[1], v[2]};
}

TEST(PairPath, GivesSpheresThatPassTheGapWhereTheyAreNearest) {
  Random random(1);
  int turning = 0, passing = 0;
  for (int k = 0; k < 2000; ++k) {
    const double touching = 2;
    const Vec3 d = uniform(random, 2, 3) * any_direction(random),
               way = uniform(random, 0, 2) * any_direction(random), n = d.normalized();
    const double gap = d.norm() - touching;
    if (!turns_on_path(space(n), gap, 0.0, space(way), d.norm())) {
      const bool straight = (way - n.dot(way) * n).norm() <= 1.01e-3 * d.norm();
      EXPECT_TRUE(straight || gap + n.dot(way) >= 0);
      continue;
    }
    ++turning;
    double nearest = INFINITY;
    for (int part = 0; part <= 20000; ++part) nearest = std::min(nearest, (d + part / 20000.0 * way).norm());
    const double found = gap_on_path(space(n), gap, space(d), space(way), touching);
    if (nearest < touching) {
      EXPECT_EQ(found, gap);
      continue;
    }
    ++passing;
    EXPECT_NEAR(found + n.dot(way), nearest - touching, 1e-8);
  }
  EXPECT_GT(turning, 200);
  EXPECT_GT(passing, 20);
}

TEST(PairPath, LeavesPairsAloneThatComeStraightAtOneAnother) {
  const Vec3 d(0, 0, 2.1), way(1e-3, 0, -0.2);
  EXPECT_FALSE(turns_on_path(space(d.normalized()), 0.1, 0.0, space(way), 2.1));
}

Wall wall_of(const std::string& shape, std::map<std::string, std::vector<double>> numbers,
             std::vector<Triangle> triangles = {}) {
  Wall wall;
  wall.shape = {shape, {std::move(numbers), "", std::move(triangles)}, nullptr};
  make_surface(wall.shape);
  return wall;
}

/// The first part of the way on which the distance of a centre from a rectangle in the plane z = 0, x <= 0 is
/// 1, by small steps; 2 where there is none.
double first_touch(const Vec3& centre, const Vec3& way) {
  for (int part = 0; part <= 100000; ++part) {
    const Vec3 x = centre + part / 100000.0 * way;
    if (std::hypot(std::max(x[0], 0.0), x[2]) <= 1) return part / 100000.0;
  }
  return 2;
}

TEST(TouchOnPath, IsThatInWhichABallFirstTouchesARimOrPassesIt) {
  Random random(2);
  const Wall wall =
      wall_of("rectangle", {{"corner", {-100, -100, 0}}, {"edge_a", {100, 0, 0}}, {"edge_b", {0, 200, 0}}});
  int touches = 0, passes = 0;
  for (int k = 0; k < 4000; ++k) {
    const Vec3 centre(uniform(random, -0.5, 1.5), 0, uniform(random, 0.5, 1.5)),
        way(uniform(random, -1, 1), uniform(random, -0.2, 0.2), uniform(random, -0.5, 0.5));
    const SurfacePoint point = point_at(wall, centre, 0),
                       met = detail::touch_on_path(wall, centre, 1, {way, way}, point);
    if (point.distance <= 1 || point.distance - 1 + point.normal.dot(way) >= 0) {
      EXPECT_EQ(met.normal, point.normal);
      EXPECT_EQ(met.distance, point.distance);
      continue;
    }
    const double part = first_touch(centre, way);
    if (part <= 1) {
      ++touches;
      const Vec3 there = centre + part * way;
      EXPECT_LT((met.normal - Vec3(std::max(there[0], 0.0), 0, there[2]).normalized()).norm(), 1e-2);
      EXPECT_LT(met.distance - 1 + met.normal.dot(way), 1e-6) << "it is stopped";
    } else {
      ++passes;
      EXPECT_GT(met.distance - 1 + met.normal.dot(way), 0) << "it is not";
    }
  }
  EXPECT_GT(touches, 300);
  EXPECT_GT(passes, 100);
}

/// A roof whose faces fall off by 45 degrees from the edge x = z = 0, its triangles in this order or in the
/// other one.
Wall roof(bool other_order) {
  std::vector<Triangle> triangles;
  const Vec3 a(0, -9, 0), b(0, 9, 0), c(-9, -9, -9), d(-9, 9, -9), e(9, -9, -9), f(9, 9, -9);
  test::add_quad(triangles, a, b, d, c);
  test::add_quad(triangles, b, a, e, f);
  test::add_quad(triangles, c, d, f, e);
  triangles.push_back({a, c, e});
  triangles.push_back({b, f, d});
  if (other_order) std::ranges::reverse(triangles);
  return wall_of("mesh", {}, std::move(triangles));
}

// Which of its triangles an edge is said to belong to is a matter of their order.
TEST(TouchOnPath, DoesNotDependOnTheOrderOfTriangles) {
  Random random(3);
  const Wall walls[] = {roof(false), roof(true)};
  int moved = 0;
  for (int k = 0; k < 2000; ++k) {
    const Vec3 centre(uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, 0.2, 1.5)),
        way(uniform(random, -1, 1), uniform(random, -0.3, 0.3), uniform(random, -0.8, 0.2));
    std::vector<SurfacePoint> judged[2];
    for (std::size_t w = 0; w < 2; ++w) {
      std::vector<SurfacePoint> points;
      collide(walls[w], centre, 4, points);
      for (const SurfacePoint& point : points) {
        judged[w].push_back(detail::touch_on_path(walls[w], centre, 1, {way, way}, point));
        moved += judged[w].back().distance != point.distance ? 1 : 0;
      }
      std::ranges::sort(judged[w], {}, [](const SurfacePoint& point) { return point.normal[0]; });
    }
    ASSERT_EQ(judged[0].size(), judged[1].size());
    for (std::size_t p = 0; p < judged[0].size(); ++p) {
      EXPECT_NEAR(judged[0][p].distance, judged[1][p].distance, 1e-9) << centre.transpose();
      EXPECT_LT((judged[0][p].normal - judged[1][p].normal).norm(), 1e-9) << way.transpose();
    }
  }
  EXPECT_GT(moved, 200);
}

// Two of the three points of a circle go round with the centre, and a tube holds what it holds.
TEST(TouchOnPath, LeavesTheInsideOfATubeAsItIs) {
  Random random(4);
  const Wall tube =
      wall_of("cylinder", {{"start", {0, 0, -9}}, {"end", {0, 0, 9}}, {"radius", {1.05}}, {"inside", {1}}});
  for (int k = 0; k < 1000; ++k) {
    const double off = uniform(random, 0, 0.05), angle = uniform(random, 0, 7);
    const Vec3 centre(off * std::cos(angle), off * std::sin(angle), 0),
        way = uniform(random, 0, 0.5) * any_direction(random);
    std::vector<SurfacePoint> points;
    collide(tube, centre, 2, points);
    ASSERT_EQ(points.size(), 3U);
    for (const SurfacePoint& point : points) {
      const SurfacePoint met = detail::touch_on_path(tube, centre, 1, {way, way}, point);
      EXPECT_EQ(met.distance, point.distance);
      EXPECT_EQ(met.normal, point.normal);
    }
  }
}

// Up to where cohesion holds it a ball stays what it is in front of.
TEST(TouchOnPath, LeavesWhatCohesionHolds) {
  const Wall wall = wall_of("disc", {{"centre", {0, 0, 0}}, {"axis", {0, 0, 1}}, {"radius", {1}}});
  const Vec3 centre(1.3, 0, 0.96), way(-0.3, 0, -0.01);
  const SurfacePoint point = point_at(wall, centre, 0);
  EXPECT_NE(detail::touch_on_path(wall, centre, 1, {way, way}, point).distance, point.distance);
  EXPECT_EQ(detail::touch_on_path(wall, centre, 1, {way, way, 0.1}, point).distance, point.distance);
}

// Others may carry it: what its weight would add is not the wall's to stop.
TEST(TouchOnPath, DoesNotStopByItsWeightABallThatPasses) {
  const Wall wall = wall_of("disc", {{"centre", {0, 0, 0}}, {"axis", {0, 0, 1}}, {"radius", {1}}});
  const Vec3 centre(1.3, 0, 1.001), way(-0.2, 0, 0), loaded(-0.2, 0, -0.002);
  const SurfacePoint met = detail::touch_on_path(wall, centre, 1, {way, loaded}, point_at(wall, centre, 0));
  EXPECT_GE(met.distance - 1 + met.normal.dot(loaded), 0);
}

}  // namespace
}  // namespace talus::path_touch_test
