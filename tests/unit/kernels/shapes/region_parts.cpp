/// Parts of spheres and of ways in regions, and passages through surfaces, against closed forms and counted
/// points.

#include "kernels/shapes/region_parts.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "kernels/samples/detail/random_numbers.hpp"

namespace talus::region_parts_test {
namespace {

constexpr double pi = std::numbers::pi;
constexpr double quadrature = 1e-5;  // of a sphere's volume: what region_parts.hpp promises

Region box(const Vec3& low, const Vec3& high) {
  Region region;
  region.low = low;
  region.high = high;
  return region;
}

Region tube(const Vec3& start, const Vec3& end, double radius) {
  Region region;
  region.kind = Region::Kind::cylinder;
  region.start = start;
  region.end = end;
  region.radius = radius;
  return region;
}

double ball(double radius) {
  return 4 * pi / 3 * radius * radius * radius;
}

/// Volume of the sphere's part by the share of the points of a fine lattice.
double counted_part(const Region& region, const Vec3& x, double radius) {
  constexpr int n = 120;
  int in = 0;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      for (int k = 0; k < n; ++k) {
        const Vec3 p = radius * ((2 * Vec3(i, j, k).array() + 1) / n - 1).matrix();
        if (p.norm() < radius && contains(region, x + p)) ++in;
      }
  return in * std::pow(2 * radius / n, 3);
}

TEST(RegionParts, AWholeSphereACapASliceAndNothing) {
  const Region region = box({0, 0, 0}, {1, 2, 3});
  EXPECT_NEAR(sphere_part(region, {0.5, 1, 1}, 0.3), ball(0.3), 1e-15);
  EXPECT_NEAR(sphere_part(region, {0, 1, 1}, 0.3), ball(0.3) / 2, 1e-15);
  const double h = 0.1;  // of a cap that lies in the box
  EXPECT_NEAR(sphere_part(region, {h - 0.3, 1, 1}, 0.3), pi * h * h * (3 * 0.3 - h) / 3, 1e-15);
  EXPECT_EQ(sphere_part(region, {-0.31, 1, 1}, 0.3), 0);
  const Region plate = box({-0.1, -9, -9}, {0.1, 9, 9});  // both faces cut
  EXPECT_NEAR(sphere_part(plate, {0, 0, 0}, 0.3), pi * (0.3 * 0.3 * 0.2 - 2 * std::pow(0.1, 3) / 3), 1e-15);
}

TEST(RegionParts, AnEdgeThroughTheCentreLeavesAQuarterACornerAnEighth) {
  const Region region = box({0, 0, 0}, {1, 1, 1});
  EXPECT_NEAR(sphere_part(region, {0, 0, 0.5}, 0.3), ball(0.3) / 4, quadrature * ball(0.3));
  EXPECT_NEAR(sphere_part(region, {0, 0, 0}, 0.3), ball(0.3) / 8, quadrature * ball(0.3));
}

TEST(RegionParts, BoxesSideBySideShareASphereWithoutALoss) {
  for (std::uint64_t k = 0; k < 200; ++k) {
    const auto a = talus::detail::uniform_pair(3, k, 0), b = talus::detail::uniform_pair(3, k, 1);
    const Vec3 x(0.6 * a[0] - 0.3, 0.6 * a[1] - 0.3, 0.6 * b[0] - 0.3);
    double sum = 0;
    for (int octant = 0; octant < 8; ++octant) {
      Vec3 low = Vec3::Constant(-1), high = Vec3::Zero();
      for (int axis = 0; axis < 3; ++axis)
        if ((octant >> axis & 1) != 0) low[axis] = 0, high[axis] = 1;
      sum += sphere_part(box(low, high), x, 0.3);
    }
    EXPECT_NEAR(sum, ball(0.3), 8 * quadrature * ball(0.3)) << x.transpose();
  }
}

TEST(RegionParts, CutsOfEdgesCornersAndMantlesAreThoseOfCountedPoints) {
  const Region tilted = tube({0, 0, 0}, {0.3, 0.4, 1.2}, 0.4);
  const Vec3 across = Vec3(0.8, -0.6, 0);  // at right angles to its axis
  for (const Vec3& x : {Vec3(0.15, 0.2, 0.6), Vec3(Vec3(0.15, 0.2, 0.6) + 0.35 * across), Vec3(0.4 * across),
                        Vec3(Vec3(0.15, 0.2, 0.6) + 0.6 * across)})
    EXPECT_NEAR(sphere_part(tilted, x, 0.3), counted_part(tilted, x, 0.3), 2e-3 * ball(0.3)) << x.transpose();
  const Region thin = tube({0, 0, -1}, {0, 0, 1}, 0.1);  // inside the sphere
  EXPECT_NEAR(sphere_part(thin, {0.05, 0, 0}, 0.3), counted_part(thin, {0.05, 0, 0}, 0.3), 2e-3 * ball(0.3));
  const Region corner = box({0, 0, 0}, {0.2, 1, 1});
  EXPECT_NEAR(sphere_part(corner, {0.1, 0.05, 0.1}, 0.3), counted_part(corner, {0.1, 0.05, 0.1}, 0.3),
              2e-3 * ball(0.3));
}

/// A cylinder of radius R about a sphere's centre cuts away what is beyond it: 4/3 pi (1 - (1 - R^2)^1.5) is
/// left.
TEST(RegionParts, ACylinderAboutTheCentreLeavesAClosedForm) {
  for (const double radius : {0.1, 0.5, 0.9, 0.999}) {
    const Region region = tube({0, 0, -2}, {0, 0, 2}, radius);
    const double left = 4 * pi / 3 * (1 - std::pow(1 - radius * radius, 1.5));
    EXPECT_NEAR(sphere_part(region, Vec3::Zero(), 1), left, quadrature * ball(1)) << radius;
  }
}

TEST(RegionParts, OfAWayTheLengthInsideCounts) {
  const Region region = box({0, 0, 0}, {1, 1, 1});
  EXPECT_DOUBLE_EQ(way_part(region, {0.2, 0.5, 0.5}, {0.7, 0.5, 0.5}), 1);
  EXPECT_DOUBLE_EQ(way_part(region, {-1, 0.5, 0.5}, {3, 0.5, 0.5}), 0.25);
  EXPECT_DOUBLE_EQ(way_part(region, {3, 0.5, 0.5}, {-1, 0.5, 0.5}), 0.25);
  EXPECT_DOUBLE_EQ(way_part(region, {0.5, 0.5, 0.5}, {0.5, 0.5, 1.5}), 0.5);
  EXPECT_EQ(way_part(region, {-1, 2, 0.5}, {3, 2, 0.5}), 0);
  const Region round = tube({0, 0, 0}, {0, 0, 4}, 1);
  EXPECT_DOUBLE_EQ(way_part(round, {-2, 0, 1}, {2, 0, 1}), 0.5);
  EXPECT_DOUBLE_EQ(way_part(round, {0.5, 0, -4}, {0.5, 0, 4}), 0.5);
  EXPECT_EQ(way_part(round, {1.5, 0, -4}, {1.5, 0, 4}), 0);
  Region beyond;
  beyond.kind = Region::Kind::beyond;
  beyond.normal = {0, 0, -3};
  EXPECT_DOUBLE_EQ(way_part(beyond, {0, 0, 1}, {5, 0, -3}), 0.75);
}

TEST(RegionParts, AWayMadeOfTwoPassesAsOftenAsBothDo) {
  Region plane;
  plane.kind = Region::Kind::plane;
  plane.point = {0, 0, 1};
  plane.normal = {0, 0, 2};
  const Vec3 below(0, 0, 0), on(0.1, 0, 1), above(0.2, 0, 3);
  EXPECT_EQ(passage(plane, below, above), 1);
  EXPECT_EQ(passage(plane, above, below), -1);
  EXPECT_EQ(passage(plane, below, on) + passage(plane, on, above), 1);
  EXPECT_EQ(passage(plane, above, on) + passage(plane, on, above), 0);
  EXPECT_EQ(passage(plane, below, on) + passage(plane, on, below), 0);
  Region disc;
  disc.kind = Region::Kind::disc;
  disc.centre = {0, 0, 1};
  disc.radius = 0.5;
  EXPECT_EQ(passage(disc, {0.4, 0, 0}, {0.4, 0, 2}), 1);
  EXPECT_EQ(passage(disc, {0.6, 0, 0}, {0.6, 0, 2}), 0);
  EXPECT_EQ(passage(disc, {-0.6, 0, 2}, {0.6, 0, 0}), -1);  // through its centre
}

}  // namespace
}  // namespace talus::region_parts_test
