// Walls as triangles, by their areas and volumes.

#include "io/results/wall_triangles.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "io/pictures/view.hpp"
#include "io/results/vtk.hpp"
#include "tests/unit/io/results/output_helpers.hpp"

namespace talus::io::wall_triangles_test {
namespace {

double area(const std::vector<Triangle>& triangles) {
  double sum = 0;
  for (const Triangle& t : triangles) sum += (t[1] - t[0]).cross(t[2] - t[0]).norm() / 2;
  return sum;
}

/// By the divergence theorem: of the closed surface, counterclockwise as seen from outside.
double volume(const std::vector<Triangle>& triangles) {
  double sum = 0;
  for (const Triangle& t : triangles) sum += t[0].dot(t[1].cross(t[2])) / 6;
  return sum;
}

Wall shaped(const std::string& name, std::map<std::string, std::vector<double>> numbers) {
  Wall wall;
  wall.shape.name = name;
  wall.shape.values.number = std::move(numbers);
  make_surface(wall.shape);
  wall.normal = Vec3::Zero();
  return wall;
}

Frame one_grain() {
  Frame frame;
  frame.id = {0};
  frame.x = {Vec3(0.5, 0.5, 0.5)};
  frame.radius = {0.1};
  return frame;
}

TEST(WallTriangles, OfABoxAreItsFaces) {
  std::vector<Wall> walls(6);
  std::vector<WallReport> now(6);
  const Vec3 size(1, 2, 3);
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side) {
      const auto w = static_cast<std::size_t>(2 * axis + side);
      now[w].normal = walls[w].normal = (side == 0 ? 1 : -1) * Vec3::Unit(axis);
      now[w].position = side == 0 ? 0 : -size[axis];
    }
  const Bounds grains{Vec3::Constant(0.1), size - Vec3::Constant(0.1)};
  const auto faces = wall_triangles(walls, now, grains);
  for (std::size_t w = 0; w < 6; ++w) {
    const double expected = size.prod() / size[static_cast<Eigen::Index>(w / 2)];
    EXPECT_NEAR(area(faces[w]), expected, 1e-6) << w;
    for (const Triangle& t : faces[w])
      for (const Vec3& corner : t) EXPECT_NEAR(now[w].normal.dot(corner), now[w].position, 1e-9);
  }
  now[0].absent = true;
  EXPECT_TRUE(wall_triangles(walls, now, grains)[0].empty());
}

TEST(WallTriangles, OfRoundSurfacesHaveTheirAreaAndGoWithTheirPose) {
  const std::vector<Wall> walls{
      shaped("cylinder", {{"start", {0, 0, 0}}, {"end", {0, 0, 2}}, {"radius", {0.5}}, {"inside", {1}}}),
      shaped("cylinder", {{"start", {0, 0, 0}}, {"end", {0, 0, 2}}, {"radius", {0.5}}}),
      shaped("disc", {{"centre", {1, 2, 3}}, {"axis", {0, 1, 0}}, {"radius", {0.5}}}),
      shaped("cone", {{"start", {0, 0, 0}}, {"end", {0, 0, 1}}, {"start_radius", {0}}, {"end_radius", {1}}})};
  std::vector<WallReport> now(4);
  now[0].pose.moved = true;
  now[0].pose.shift = {0, 0, 7};
  const auto shown = wall_triangles(walls, now, grain_bounds(one_grain()));
  const double pi = std::numbers::pi;
  EXPECT_NEAR(area(shown[0]), 2 * pi * 0.5 * 2, 0.01);  // 64 corners: 0.04 % short
  EXPECT_NEAR(volume(shown[1]), pi * 0.25 * 2, 0.005) << "a solid is closed, and faces outward";
  EXPECT_NEAR(area(shown[2]), pi * 0.25, 0.005);
  EXPECT_NEAR(volume(shown[3]), pi / 3, 0.01) << "a cone with a tip";
  for (const Triangle& t : shown[0])
    for (const Vec3& corner : t) EXPECT_TRUE(corner.z() == 7 || corner.z() == 9);
}

TEST(WallTriangles, OfAPlaneAloneReachAsFarAsTheGrains) {
  std::vector<Wall> walls(1);
  std::vector<WallReport> now(1);
  now[0].normal = Vec3::UnitZ();
  now[0].position = 0.4;
  EXPECT_NEAR(area(wall_triangles(walls, now, grain_bounds(one_grain()))[0]), 0.2 * 0.2, 1e-6);
  EXPECT_TRUE(wall_triangles(walls, now, grain_bounds(Frame{}))[0].empty())
      << "without grains it has no size";
}

TEST(WallTriangles, StandInTheFileForParaView) {
  const Frame frame = test::three_grains();
  const std::vector<std::vector<Triangle>> triangles{{{Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)}}, {}};
  const std::vector<std::int64_t> materials{3, 4};
  const std::string text = walls_vtp(frame, triangles, materials);
  EXPECT_NE(text.find("NumberOfPoints=\"3\""), std::string::npos);
  EXPECT_NE(text.find("NumberOfPolys=\"1\""), std::string::npos);
  for (const char* name : {"wall", "material", "velocity", "force", "TimeValue"})
    EXPECT_NE(text.find("Name=\"" + std::string(name) + "\""), std::string::npos) << name;
}

TEST(Edges, AreThoseOfABoxAndNotOfAMantle) {
  const std::vector<Wall> walls{
      shaped("cylinder", {{"start", {0, 0, 0}}, {"end", {0, 0, 2}}, {"radius", {0.5}}, {"inside", {1}}}),
      shaped("rectangle", {{"corner", {0, 0, 0}}, {"edge_a", {1, 0, 0}}, {"edge_b", {0, 1, 0}}})};
  const auto shown = wall_triangles(walls, std::vector<WallReport>(2), grain_bounds(one_grain()));
  EXPECT_EQ(edges_of(shown[0]).size(), 2u * 64u) << "both rims";
  EXPECT_EQ(edges_of(shown[1]).size(), 4u) << "not the diagonal";
  EXPECT_TRUE(bends_of(shown[1]).empty());
  // Of a tube one sees two lines along its axis from the side, and no more.
  const auto outlines = [&](const Vec3& viewer) {
    return std::ranges::count_if(bends_of(shown[0]), [&](const Bend& bend) { return bend.outlines(viewer); });
  };
  EXPECT_GE(bends_of(shown[0]).size(), 64u);
  EXPECT_EQ(outlines(Vec3(0.31, 0.95, 0)), 2);
}

}  // namespace
}  // namespace talus::io::wall_triangles_test
