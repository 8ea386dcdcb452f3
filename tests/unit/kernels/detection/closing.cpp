#include "kernels/detection/closing.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/unit/dense_sample.hpp"

namespace talus {
namespace {

// A step of the inverse brings no pair nearer than the larger of its gap and `near`, by straight motion of
// all pairs there are; half as much again does for some pair.
TEST(ClosingRate, BoundsWhatPairsMayUseUp) {
  for (const double near : {1e-3, 0.05, 1.0}) {
    const Bodies bodies = test::jittered_lattice(5, 11);
    const std::vector<Wall> walls = test::box_of_walls(-0.7, 4.7);
    const Candidates candidates = test::find_candidates(bodies, walls, 0.3, false);
    const double rate = closing_rate(candidates, bodies, {bodies.x, bodies.radius, walls}, near);
    ASSERT_GT(rate, 0);
    double most = 0;  // closed in a time of 1/rate, over what may be
    for (const auto& [first, second] : candidates.grain_pairs) {
      const auto i = static_cast<std::size_t>(first), j = static_cast<std::size_t>(second);
      const Vec3 d = bodies.x[i] - bodies.x[j];
      const Vec3 v =
          Eigen::Map<const Vec3>(bodies.velocity[i].u) - Eigen::Map<const Vec3>(bodies.velocity[j].u);
      const double gap = d.norm() - bodies.radius[i] - bodies.radius[j];
      most = std::max(most, -v.dot(d) / d.norm() / rate / std::max(gap, near));
    }
    for (const WallPair& pair : candidates.wall_pairs) {
      const auto i = static_cast<std::size_t>(pair.body);
      const Wall& wall = walls[static_cast<std::size_t>(pair.wall)];
      const double gap = wall.normal.dot(bodies.x[i] - wall.point) - bodies.radius[i];
      most = std::max(
          most, -wall.normal.dot(Eigen::Map<const Vec3>(bodies.velocity[i].u)) / rate / std::max(gap, near));
    }
    EXPECT_NEAR(most, 1, 1e-12);
  }
}

TEST(ClosingRate, IsNoneWherePairsPartOrStand) {
  Bodies bodies;
  for (const double x : {0.0, 1.1}) add_sphere(bodies, BodyId{x > 0}, Vec3(x, 0, 0), 0.5, 1000);
  Candidates candidates;
  candidates.grain_pairs = {{0, 1}};
  const Poses poses{bodies.x, bodies.radius, {}};
  EXPECT_EQ(closing_rate(candidates, bodies, poses, 0.01), 0);
  bodies.velocity[1].u[0] = 1;
  EXPECT_EQ(closing_rate(candidates, bodies, poses, 0.01), 0);
  bodies.velocity[1].u[0] = -1;
  EXPECT_NEAR(closing_rate(candidates, bodies, poses, 0.01), 1 / 0.1, 1e-12);
  EXPECT_NEAR(closing_rate(candidates, bodies, poses, 0.4), 1 / 0.4, 1e-12);
}

}  // namespace
}  // namespace talus
