/// Clumps in pictures: as the balls that they are made of.

#include "io/results/grain_balls.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "io/pictures/picture.hpp"
#include "io/pictures/view.hpp"
#include "io/results/results.hpp"
#include "runtime/graph/one_rank.hpp"
#include "tests/unit/io/results/output_helpers.hpp"

namespace talus::io::grain_balls_test {
namespace {

/// Two balls of half the radius, along x.
Clump pair_of_balls() {
  Clump clump;
  clump.balls = {{{-0.5, 0, 0}, 0.5}, {{0.5, 0, 0}, 0.5}};
  return clump;
}

/// One grain of radius 2 at (1, 0, 0), turned about y by this angle.
Frame one_grain(double angle) {
  Frame frame;
  frame.id = {7};
  frame.x = {Vec3(1, 0, 0)};
  frame.radius = {2};
  frame.u = {Vec3::Zero()};
  frame.orientation = {{std::cos(angle / 2), 0, std::sin(angle / 2), 0}};
  return frame;
}

std::size_t circles(const std::string& svg) {
  std::size_t found = 0;
  for (std::size_t at = svg.find("<circle"); at != std::string::npos; at = svg.find("<circle", at + 1))
    ++found;
  return found;
}

bool is_white(const Image& image, std::size_t x, std::size_t y) {
  const std::size_t at = 3 * (y * image.width + x);
  return image.rgb[at] == 255 && image.rgb[at + 1] == 255 && image.rgb[at + 2] == 255;
}

TEST(GrainBalls, StandWhereTheClumpHasTurnedThem) {
  const std::vector<SeenBall> balls = seen_balls(one_grain(std::numbers::pi / 2), {.clump = pair_of_balls()});
  ASSERT_EQ(balls.size(), 2U);
  EXPECT_NEAR((balls[0].centre - Vec3(1, 0, 1)).norm(), 0, 1e-12);  // -x has turned to +z
  EXPECT_NEAR((balls[1].centre - Vec3(1, 0, -1)).norm(), 0, 1e-12);
  EXPECT_EQ(balls[1].radius, 1);
  EXPECT_EQ(balls[1].grain, 0U);
}

TEST(GrainBalls, OfSpheresAndOfWhatWasInsertedAreTheGrains) {
  EXPECT_EQ(seen_balls(one_grain(0), {}).size(), 1U);
  EXPECT_EQ(seen_balls(one_grain(0), {.clump = pair_of_balls(), .spheres_from = 7}).size(), 1U);
  EXPECT_EQ(seen_balls(one_grain(0), {.clump = pair_of_balls(), .spheres_from = 8}).size(), 2U);
  Frame without = one_grain(0);
  without.orientation.clear();
  EXPECT_EQ(seen_balls(without, {.clump = pair_of_balls()}).size(), 1U);
}

TEST(GrainBalls, AViewShowsTheGapsBesideAClump) {
  ViewOptions options;
  options.camera = {-90, 0};
  options.width = 200;
  // Above the point where the balls touch there is a sphere, but no clump.
  EXPECT_FALSE(is_white(render_view(one_grain(0), {}, {}, options), 100, 40));
  options.shapes.clump = pair_of_balls();
  const Image clump = render_view(one_grain(0), {}, {}, options);
  EXPECT_TRUE(is_white(clump, 100, 40));
  EXPECT_FALSE(is_white(clump, 60, 100));
  EXPECT_FALSE(is_white(clump, 140, 100));
}

TEST(GrainBalls, PicturesOfASlabDrawThemAndARankGathersWhatTheyNeed) {
  const GrainShapes shapes{.clump = pair_of_balls()};
  const auto [slab, sample] = gather_slab(one_grain(0.3), graph::one_rank());
  EXPECT_EQ(circles(draw_velocities(slab, {.sample = sample, .shapes = shapes})), 2U);
  EXPECT_EQ(circles(draw_forces(slab, {}, {.sample = sample, .shapes = shapes})), 2U);
}

TEST(GrainBalls, SpheresAmongClumpsHaveIdsBeyondThoseOfTheFirstFrame) {
  const std::vector<Clump> clumps{pair_of_balls()};
  const test::ScratchDirectory scratch;
  const std::filesystem::path results = scratch / "results.h5";
  Frame first = one_grain(0);
  first.omega = {Vec3::Zero()};
  ResultsWriter(results, {}).append(first);
  EXPECT_EQ(grain_shapes(clumps, true, results).spheres_from, 8);
  EXPECT_GT(grain_shapes(clumps, false, results).spheres_from, 8) << "nothing is inserted";
  EXPECT_GT(grain_shapes(clumps, true, scratch / "none.h5").spheres_from, 8);
  EXPECT_FALSE(grain_shapes({}, true, results).clump);
  // Of a first frame that is not of the beginning nobody can tell who was inserted; nor of one that is gone.
  const std::filesystem::path later = scratch / "later.h5";
  first.step = 5;
  ResultsWriter(later, {}).append(first);
  EXPECT_FALSE(grain_shapes(clumps, true, later).clump);
  EXPECT_TRUE(grain_shapes(clumps, false, later).clump);
  std::filesystem::resize_file(later, 100);
  EXPECT_FALSE(grain_shapes(clumps, true, later).clump);
}

}  // namespace
}  // namespace talus::io::grain_balls_test
