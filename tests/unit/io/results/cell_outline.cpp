/// The periodic cell in files for viewers.

#include "io/results/cell_outline.hpp"

#include <gtest/gtest.h>

#include "io/results/vtk.hpp"
#include "tests/unit/io/results/output_helpers.hpp"

namespace talus::io::cell_outline_test {
namespace {

using namespace talus::test;

/// Two grains that touch across the faces along x of a cell that leans, and bounds along y.
Frame two_across_a_face() {
  Frame frame;
  frame.id = {0, 1};
  frame.x = {Vec3(0.05, 0.5, 0.5), Vec3(0.95, 0.5, 0.5)};
  frame.radius = {0.05, 0.05};
  frame.u.assign(2, Vec3::Zero());
  frame.contact_bodies = {{0, 1}};
  frame.contact_point = {Vec3(0, 0.5, 0.5)};
  frame.contact_normal = {Vec3(1, 0, 0)};
  frame.contact_gap = {0};
  frame.contact_force = {Vec3(2, 0, 0)};
  frame.domain = periodic_domain({1, 0, 2}, Vec3::Zero(), {0, 0.25, 0});
  return frame;
}

Bounds grains_of() {
  return {{0, 0.45, 0.45}, {1, 0.55, 0.55}};
}

TEST(CellOutline, IsTheBrickOfTheGrainsAndTheEdgesOfACellThatLeans) {
  const std::string text = cell_vtp(two_across_a_face(), grains_of());
  EXPECT_TRUE(well_formed(text));
  const auto edge = array_of<std::int64_t>(text, "edge");
  const auto points = array_of<float>(text, "Points");
  ASSERT_EQ(edge.size(), 15U);
  ASSERT_EQ(points.size(), 15U * 6);
  for (std::size_t k = 0; k < 12; ++k) {
    EXPECT_EQ(edge[k], 0);
    for (std::size_t end = 0; end < 2; ++end) {
      const float* at = &points[6 * k + 3 * end];
      EXPECT_TRUE(at[0] == 0 || at[0] == 1) << k;
      EXPECT_TRUE(at[1] == 0.45F || at[1] == 0.55F) << k << ": between walls as far as grains";
      EXPECT_TRUE(at[2] == 0 || at[2] == 2) << k;
    }
  }
  EXPECT_EQ(edge[14], 3);
  EXPECT_EQ(points[6 * 14 + 3], 0.25F) << "c leans along x";
  EXPECT_EQ(points[6 * 14 + 5], 2);
}

TEST(CellOutline, UprightIsTwelveLinesAndBetweenWallsNone) {
  Frame frame = two_across_a_face();
  frame.domain = periodic_domain({1, 1, 2});
  EXPECT_EQ(array_of<std::int64_t>(cell_vtp(frame, grains_of()), "edge").size(), 12U);
  frame.domain = {};
  EXPECT_TRUE(array_of<std::int64_t>(cell_vtp(frame, grains_of()), "edge").empty());
}

TEST(ForceLines, AcrossAFaceGoOnOutsideAndNotThroughTheCell) {
  const auto points = array_of<float>(forces_vtp(two_across_a_face()), "Points");
  ASSERT_EQ(points.size(), 6U);
  EXPECT_EQ(points[0], 0.05F);
  EXPECT_NEAR(points[3], -0.05, 1e-7);
}

}  // namespace
}  // namespace talus::io::cell_outline_test
