/// Rectangle, disc and cylinder at places where the nearest point is known.

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "kernels/shapes/shape.hpp"

namespace talus::surfaces_test {
namespace {

using Numbers = std::map<std::string, std::vector<double>>;

std::shared_ptr<const Surface> make(const std::string& name, const Numbers& numbers) {
  return wall_shape(name)->make({.number = numbers, .file = {}, .triangles = {}});
}

std::vector<SurfacePoint> touched(const Surface& surface, const Vec3& centre, double reach) {
  std::vector<SurfacePoint> points;
  surface.collide(centre, reach, points);
  return points;
}

void expect_normal(const SurfacePoint& point, const Vec3& normal) {
  EXPECT_LT((point.normal - normal).norm(), 1e-12) << point.normal.transpose();
}

TEST(Rectangle, IsTouchedOnItsFaceAtItsEdgesAndAtItsCorners) {
  const auto plate = make("rectangle", {{"corner", {0, 0, 1}}, {"edge_a", {2, 0, 0}}, {"edge_b", {0, 3, 0}}});
  EXPECT_DOUBLE_EQ(plate->at({1, 1, 1.5}, 0).distance, 0.5);
  expect_normal(plate->at({1, 1, 1.5}, 0), Vec3::UnitZ());
  expect_normal(plate->at({1, 1, 0.5}, 0), -Vec3::UnitZ());
  EXPECT_DOUBLE_EQ(plate->at({-3, 1, 5}, 0).distance, 5) << "3, 4, 5 from the edge x = 0";
  expect_normal(plate->at({-3, 1, 5}, 0), Vec3(-0.6, 0, 0.8));
  expect_normal(plate->at({3, 4, 2}, 0), Vec3(1, 1, 1) / std::sqrt(3.0));
}

TEST(Rectangle, RefusesEdgesThatAreNotAtRightAngles) {
  EXPECT_THROW(make("rectangle", {{"corner", {0, 0, 0}}, {"edge_a", {1, 0, 0}}, {"edge_b", {1, 1, 0}}}),
               std::invalid_argument);
  EXPECT_THROW(make("rectangle", {{"corner", {0, 0, 0}}, {"edge_a", {1, 0, 0}}, {"edge_b", {0, 0, 0}}}),
               std::invalid_argument);
}

TEST(Disc, IsTouchedOnItsFaceAndAtItsRim) {
  const auto disc = make("disc", {{"centre", {0, 0, 0}}, {"axis", {0, 0, 7}}, {"radius", {1}}});
  EXPECT_DOUBLE_EQ(disc->at({0.3, 0.4, -2}, 0).distance, 2);
  expect_normal(disc->at({0.3, 0.4, -2}, 0), -Vec3::UnitZ());
  EXPECT_DOUBLE_EQ(disc->at({4, 0, 4}, 0).distance, 5);
  expect_normal(disc->at({4, 0, 4}, 0), Vec3(0.6, 0, 0.8));
}

TEST(Cylinder, FromOutsideIsASolidWithClosedEnds) {
  const auto rod = make("cylinder", {{"start", {0, 0, 0}}, {"end", {0, 0, 2}}, {"radius", {1}}});
  EXPECT_DOUBLE_EQ(rod->at({3, 0, 1}, 0).distance, 2);
  expect_normal(rod->at({0.5, 0, 3}, 0), Vec3::UnitZ());
  expect_normal(rod->at({4, 0, 6}, 0), Vec3(0.6, 0, 0.8));
  EXPECT_DOUBLE_EQ(rod->at({0.9, 0, 1}, 0).distance, 0.9 - 1) << "inside the solid";
  expect_normal(rod->at({0.9, 0, 1}, 0), Vec3::UnitX());
  EXPECT_EQ(touched(*rod, {3, 0, 1}, 2.5).size(), 1u);
  EXPECT_TRUE(touched(*rod, {3, 0, 1}, 1.5).empty());
}

TEST(Cylinder, FromInsideHoldsALargeSphereInThreePointsAndASmallOneInOne) {
  const auto tube =
      make("cylinder", {{"start", {0, 0, 0}}, {"end", {0, 0, 2}}, {"radius", {1}}, {"inside", {1}}});
  const auto small = touched(*tube, {0.8, 0, 1}, 0.25);
  ASSERT_EQ(small.size(), 1u);
  EXPECT_NEAR(small[0].distance, 0.2, 1e-15);
  expect_normal(small[0], -Vec3::UnitX());
  const auto large = touched(*tube, {0, 0, 1}, 1.1);
  ASSERT_EQ(large.size(), 3u);
  Vec3 sum = Vec3::Zero();
  for (const SurfacePoint& point : large) {
    EXPECT_DOUBLE_EQ(point.distance, 1);
    sum += point.normal;
  }
  EXPECT_LT(sum.norm(), 1e-15) << "a third of a turn apart";
  expect_normal(tube->at({0.8, 0, 5}, 0), Vec3(-0.2, 0, 3) / std::hypot(0.2, 3.0));
}

TEST(WallShapes, RefuseWhatMakesNoSurface) {
  EXPECT_THROW(make("disc", {{"centre", {0, 0, 0}}, {"axis", {0, 0, 0}}, {"radius", {1}}}),
               std::invalid_argument);
  EXPECT_THROW(make("cylinder", {{"start", {1, 0, 0}}, {"end", {1, 0, 0}}, {"radius", {1}}}),
               std::invalid_argument);
  const Numbers endless = {{"corner", {0, 0, 0}}, {"edge_a", {1e200, 0, 0}}, {"edge_b", {0, 1, 0}}};
  WallShape plate{
      .name = "rectangle", .values = {.number = endless, .file = {}, .triangles = {}}, .surface = {}};
  EXPECT_THROW(make_surface(plate), std::invalid_argument);
  EXPECT_EQ(wall_shape("plane"), nullptr);
}

}  // namespace
}  // namespace talus::surfaces_test
