#include "kernels/shapes/region.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "kernels/samples/detail/random_numbers.hpp"

namespace talus {
namespace {

Region tilted_cylinder() {
  Region region;
  region.kind = Region::Kind::cylinder;
  region.start = {1, 2, 3};
  region.end = {2, 2.5, 4};
  region.radius = 0.4;
  return region;
}

Region box() {
  Region region;
  region.low = {-1, 0, 2};
  region.high = {1, 0.5, 2.3};
  return region;
}

Region disc() {
  Region region;
  region.kind = Region::Kind::disc;
  region.centre = {0, 0, 1};
  region.axis = {0, 0, 2};
  region.radius = 0.5;
  return region;
}

std::array<double, 3> numbers(std::uint64_t k) {
  const auto a = detail::uniform_pair(7, k, 0), b = detail::uniform_pair(7, k, 1);
  return {a[0], a[1], b[0]};
}

TEST(Regions, EveryPlaceThatIsDrawnHoldsTheWholeSphere) {
  for (const Region& region : {box(), tilted_cylinder(), disc()}) {
    constexpr double radius = 0.1;
    ASSERT_TRUE(has_room(region, radius));
    int found = 0;
    for (std::uint64_t k = 0; k < 2000; ++k) {
      const Place place = place_in(region, radius, numbers(k));
      if (!place.found) continue;
      ++found;
      EXPECT_TRUE(holds(region, place.x, radius * (1 - 1e-12))) << k;
      EXPECT_EQ(contains(region, place.x), region.kind != Region::Kind::disc);
    }
    EXPECT_GT(found, region.kind == Region::Kind::box ? 1999 : 1500);
  }
}

/// Half of the places in a cylinder lie within 1/sqrt(2) of the radius that centres may have.
TEST(Regions, PlacesAreEvenOverTheCrossSection) {
  const Region region = tilted_cylinder();
  const Vec3 axis = (region.end - region.start).normalized();
  int found = 0, inner = 0;
  for (std::uint64_t k = 0; k < 20000; ++k) {
    const Place place = place_in(region, 0.1, numbers(k));
    if (!place.found) continue;
    ++found;
    const Vec3 from = place.x - region.start;
    if ((from - from.dot(axis) * axis).norm() < 0.3 / std::sqrt(2)) ++inner;
  }
  EXPECT_NEAR(static_cast<double>(inner) / found, 0.5, 4 * 0.5 / std::sqrt(found));
}

TEST(Regions, TheBoxAroundATiltedCylinderTouchesItsRims) {
  const Region region = tilted_cylinder();
  const Bounds bounds = bounds_of(region);
  const Vec3 axis = (region.end - region.start).normalized();
  Vec3 low = region.start, high = region.start;
  for (int k = 0; k < 3600; ++k) {
    const double angle = k * M_PI / 1800;
    const Vec3 first = axis.unitOrthogonal(), second = axis.cross(first);
    const Vec3 rim = region.radius * (std::cos(angle) * first + std::sin(angle) * second);
    for (const Vec3& end : {region.start, region.end}) {
      low = low.cwiseMin(end + rim);
      high = high.cwiseMax(end + rim);
    }
  }
  EXPECT_LT((bounds.low - low).norm(), 1e-6);
  EXPECT_LT((bounds.high - high).norm(), 1e-6);
}

TEST(Regions, BeyondAPlaneIsOneSideOfIt) {
  Region region;
  region.kind = Region::Kind::beyond;
  region.point = {0, 0, -0.5};
  region.normal = {0, 0, -3};
  EXPECT_TRUE(contains(region, {5, 5, -0.51}));
  EXPECT_FALSE(contains(region, {5, 5, -0.49}));
}

TEST(Regions, SayWhatMakesNoSense) {
  Region flat = box();
  flat.high[1] = flat.low[1];
  EXPECT_STRNE(fault_of(flat), "");
  Region point = tilted_cylinder();
  point.end = point.start;
  EXPECT_STRNE(fault_of(point), "");
  EXPECT_STREQ(fault_of(box()), "");
  EXPECT_FALSE(has_room(box(), 0.2));
  EXPECT_FALSE(has_room(disc(), 0.6));
}

}  // namespace
}  // namespace talus
