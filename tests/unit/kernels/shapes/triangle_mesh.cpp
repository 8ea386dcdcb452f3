#include "kernels/shapes/detail/triangle_mesh.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>

#include "tests/unit/mesh_makers.hpp"

namespace talus::triangle_mesh_test {
namespace {

using detail::make_mesh;
using test::box_mesh;

std::vector<SurfacePoint> touched(const Surface& surface, const Vec3& centre, double reach) {
  std::vector<SurfacePoint> points;
  surface.collide(centre, reach, points);
  return points;
}

std::string refusal(std::vector<Triangle> triangles) {
  try {
    make_mesh(std::move(triangles), false);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(NearestPoint, IsThatOfASearchOverTheTriangle) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> number(-1, 1);
  const auto point = [&] { return Vec3(number(random), number(random), number(random)); };
  constexpr int n = 60;
  for (int k = 0; k < 300; ++k) {
    const Triangle triangle{point(), point(), point()};
    const Vec3 x = 2 * point();
    double best = std::numeric_limits<double>::infinity();
    for (int i = 0; i <= n; ++i)
      for (int j = 0; i + j <= n; ++j)
        best = std::min(best, (x - triangle[0] - static_cast<double>(i) / n * (triangle[1] - triangle[0]) -
                               static_cast<double>(j) / n * (triangle[2] - triangle[0]))
                                  .norm());
    const double found = (x - detail::nearest_point(triangle, x)).norm();
    EXPECT_LE(found, best + 1e-12);
    EXPECT_GE(found, best - 3.0 / n) << "and it lies on the triangle";
  }
}

TEST(TriangleMesh, FindsTheTrianglesThatAllPairsFind) {
  const std::vector<Triangle> triangles = test::funnel_mesh(0.2, 1, 1.5, 0.1, 24);
  const auto mesh = make_mesh(triangles, false);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> number(-1.5, 1.5);
  std::size_t found = 0;
  for (int k = 0; k < 2000; ++k) {
    const Vec3 x(number(random), number(random), number(random) + 0.75);
    const double reach = 0.3 * std::abs(number(random));
    std::vector<std::int32_t> near, all;
    mesh->near(x, reach, near);
    for (std::size_t t = 0; t < triangles.size(); ++t)
      if ((x - detail::nearest_point(triangles[t], x)).norm() < reach)
        all.push_back(static_cast<std::int32_t>(t));
    ASSERT_EQ(near, all) << x.transpose() << " reach " << reach;
    found += near.size();
    for (const SurfacePoint& point : touched(*mesh, x, reach))
      ASSERT_TRUE(std::ranges::binary_search(all, point.feature));
  }
  EXPECT_GT(found, 2000u);
}

TEST(TriangleMesh, OfOnePlaneIsTouchedOnceAnywhereWithTheNormalOfThePlane) {
  const auto floor = make_mesh(box_mesh({-1, -1, -0.5}, {1, 1, 0}, 7), false);
  std::mt19937 random(4);
  std::uniform_real_distribution<double> number(-0.7, 0.7);
  for (int k = 0; k < 2000; ++k) {
    // Many on the edges and corners of the triangles, too.
    const double step = 2.0 / 7;
    Vec3 x(number(random), number(random), 0.29 + 0.01 * (k % 3));
    if (k % 2 == 0) x[0] = -1 + step * std::round((x[0] + 1) / step);
    if (k % 4 == 0) x[1] = -1 + step * std::round((x[1] + 1) / step);
    const auto points = touched(*floor, x, 0.35);
    ASSERT_EQ(points.size(), 1u) << x.transpose();
    EXPECT_NEAR(points[0].distance, x[2], 1e-15);
    EXPECT_LT((points[0].normal - Vec3::UnitZ()).norm(), 1e-14);
  }
}

TEST(TriangleMesh, IsTouchedOnceAtItsOutwardEdgesAndCorners) {
  const auto box = make_mesh(box_mesh({0, 0, 0}, {1, 1, 1}, 2), false);
  const auto edge = touched(*box, {1.03, 0.4, 1.04}, 0.1);
  ASSERT_EQ(edge.size(), 1u);
  EXPECT_NEAR(edge[0].distance, 0.05, 1e-15);
  EXPECT_LT((edge[0].normal - Vec3(0.6, 0, 0.8)).norm(), 1e-13);
  const auto corner = touched(*box, {1.01, 1.02, 1.02}, 0.1);
  ASSERT_EQ(corner.size(), 1u);
  EXPECT_NEAR(corner[0].distance, 0.03, 1e-15);
}

TEST(TriangleMesh, SphereInAnInwardEdgeTouchesTwoFacesAndInAnInwardCornerThree) {
  const auto room = make_mesh(box_mesh({0, 0, 0}, {1, 1, 1}, 3), true);
  const auto edge = touched(*room, {0.1, 0.45, 0.1}, 0.15);
  ASSERT_EQ(edge.size(), 2u);
  EXPECT_LT((edge[0].normal + edge[1].normal - Vec3(1, 0, 1)).norm(), 1e-13);
  EXPECT_EQ(touched(*room, {0.1, 0.1, 0.1}, 0.15).size(), 3u);
  EXPECT_EQ(touched(*room, {0.1, 0.5, 0.5}, 0.15).size(), 1u);
}

TEST(TriangleMesh, IsNotTouchedFromBehindAThinWall) {
  const auto sheet = make_mesh(box_mesh({-1, -1, -0.01}, {1, 1, 0}, 3), false);
  const auto points = touched(*sheet, {0.1, 0.2, 0.3}, 0.4);
  ASSERT_EQ(points.size(), 1u) << "the lower face is nearer than the reach";
  EXPECT_NEAR(points[0].distance, 0.3, 1e-15);
}

/// Signed: 1 within a closed surface, 0 without (van Oosterom and Strackee 1983).
double winding(const std::vector<Triangle>& triangles, const Vec3& p) {
  double angle = 0;
  for (const Triangle& triangle : triangles) {
    const Vec3 a = triangle[0] - p, b = triangle[1] - p, c = triangle[2] - p;
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    angle += 2 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return angle / (4 * 3.14159265358979324);
}

TEST(TriangleMesh, KnowsHowDeepACentreLiesInTheSolidOnBothSidesOfItsSurface) {
  const std::vector<Triangle> triangles = test::funnel_mesh(0.2, 1, 1.5, 0.1, 24);
  const auto funnel = make_mesh(triangles, false), around = make_mesh(triangles, true);
  std::mt19937 random(6);
  std::uniform_real_distribution<double> number(-1.2, 1.2);
  int solid = 0;
  for (int k = 0; k < 4000; ++k) {
    Vec3 x(number(random), number(random), number(random) + 0.75);
    if (k % 4 == 0) x[1] = 0;  // in the plane of edges and corners
    if (k % 8 == 0) x[0] = std::round(4 * x[0]) / 4;
    double nearest = std::numeric_limits<double>::infinity();
    for (const Triangle& triangle : triangles)
      nearest = std::min(nearest, (x - detail::nearest_point(triangle, x)).norm());
    if (nearest < 1e-9) continue;
    const bool in = winding(triangles, x) > 0.5;
    EXPECT_EQ(funnel->depth(x), in ? nearest : 0) << x.transpose();
    EXPECT_EQ(around->depth(x), in ? 0 : nearest) << x.transpose();
    solid += in ? 1 : 0;
  }
  EXPECT_GT(solid, 100);
}

/// A lattice of grains in a box of cells as wide as the lattice: every ray goes through edges and corners.
TEST(TriangleMesh, KnowsItsInsideWhereRaysMeetEdgesAndCorners) {
  constexpr int n = 4;
  const auto room = make_mesh(box_mesh({0, 0, 0}, {1, 1, 1}, n), true);
  for (int x = -n; x <= 2 * n; ++x)
    for (int y = -n; y <= 2 * n; ++y)
      for (int z = -n; z <= 2 * n; ++z) {
        const auto strictly = [](int from, int to) { return [=](int i) { return from < i && i < to; }; };
        const bool in = std::ranges::all_of(std::array{x, y, z}, strictly(0, n));
        const bool out = !std::ranges::all_of(std::array{x, y, z}, strictly(-1, n + 1));
        const double depth = room->depth(Vec3(x, y, z) / n);
        EXPECT_TRUE(!in || depth == 0) << x << ' ' << y << ' ' << z;
        EXPECT_TRUE(!out || depth >= 1.0 / n) << x << ' ' << y << ' ' << z;
      }
}

TEST(TriangleMesh, RefusalsNameTheTriangle) {
  std::vector<Triangle> triangles = box_mesh({0, 0, 0}, {1, 1, 1});
  EXPECT_EQ(refusal(triangles), "");
  auto changed = triangles;
  changed[4][1][2] = std::nan("");
  EXPECT_NE(refusal(changed).find("triangle 5 has a corner that is not finite"), std::string::npos)
      << refusal(changed);
  changed = triangles;
  changed[6][2] = changed[6][0];
  EXPECT_NE(refusal(changed).find("triangle 7 is degenerate"), std::string::npos) << refusal(changed);
  changed = triangles;
  changed.pop_back();
  EXPECT_NE(refusal(changed).find("open at an edge of triangle"), std::string::npos) << refusal(changed);
  changed = triangles;
  std::swap(changed[3][0], changed[3][1]);
  EXPECT_NE(refusal(changed).find("is inverted against triangle"), std::string::npos) << refusal(changed);
  changed = triangles;
  for (Triangle& triangle : changed) std::swap(triangle[0], triangle[1]);
  EXPECT_NE(refusal(changed).find("face into the solid"), std::string::npos) << refusal(changed);
  EXPECT_NE(refusal({}).find("no triangles"), std::string::npos);
}

}  // namespace
}  // namespace talus::triangle_mesh_test
