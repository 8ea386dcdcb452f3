/// Whether a sphere meets any body of a grid, against a loop over all of them.

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "kernels/detection/broad_phase.hpp"
#include "kernels/detection/wall_pairs.hpp"
#include "kernels/shapes/detail/triangle_mesh.hpp"
#include "tests/unit/mesh_makers.hpp"

namespace talus::meets_any_test {
namespace {

TEST(MeetsAny, IsWhatALoopOverAllBodiesSaysForRadiiOneToAHundred) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> place(-1, 1), exponent(-2, 0);
  const auto point = [&] { return Vec3(place(random), place(random), place(random)); };
  std::vector<Vec3> x;
  std::vector<double> reach;
  for (int k = 0; k < 400; ++k) {
    x.push_back(point());
    reach.push_back(0.2 * std::pow(10, exponent(random)));
  }
  const CellGrid grid = build_cells(x, reach);
  int met = 0;
  for (int k = 0; k < 3000; ++k) {
    const Vec3 centre = 1.5 * point();
    const double radius = 0.2 * std::pow(10, exponent(random));
    bool any = false;
    for (std::size_t b = 0; b < x.size(); ++b)
      any = any || (x[b] - centre).squaredNorm() < (reach[b] + radius) * (reach[b] + radius);
    ASSERT_EQ(meets_any(grid, centre, radius), any) << k;
    met += any ? 1 : 0;
  }
  EXPECT_GT(met, 100);
  EXPECT_LT(met, 2700);
}

TEST(MeetsAny, NobodyIsMetWhereNobodyIs) {
  EXPECT_FALSE(meets_any(build_cells({}, {}), Vec3::Zero(), 1));
}

TEST(MeetsWall, BehindAPlaneNothingHasRoom) {
  Wall floor;
  EXPECT_TRUE(meets_wall(floor, {0, 0, 0.09}, 0.1));
  EXPECT_TRUE(meets_wall(floor, {0, 0, -5}, 0.1));
  EXPECT_FALSE(meets_wall(floor, {0, 0, 0.11}, 0.1));
}

TEST(MeetsWall, DeepInTheSolidOfAMeshNothingHasRoom) {
  for (const bool inside : {false, true}) {
    Wall box;
    box.shape.surface = detail::make_mesh(test::box_mesh({0, 0, 0}, {1, 1, 1}, 3), inside);
    box.pose.moved = true;
    box.pose.shift = Vec3(5, 0, 0);
    EXPECT_EQ(meets_wall(box, {5.5, 0.5, 0.5}, 0.1), !inside);
    EXPECT_EQ(meets_wall(box, {8, 0.5, 0.5}, 0.1), inside);
    EXPECT_TRUE(meets_wall(box, {5.5, 0.5, 0.05}, 0.1));
  }
}

}  // namespace
}  // namespace talus::meets_any_test
