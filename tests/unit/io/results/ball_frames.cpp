/// Frames of clumps as frames of balls.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "io/results/grain_balls.hpp"
#include "io/results/lammps_dump.hpp"

namespace talus::io::ball_frames_test {
namespace {

/// A sphere, and a pair of balls of half its radius along x that stands upright and turns about x.
struct Mixed {
  GrainShapes shapes;
  Frame frame;

  Mixed() {
    shapes.clump.emplace();
    shapes.clump->balls = {{{-0.5, 0, 0}, 0.5}, {{0.5, 0, 0}, 0.5}};
    shapes.spheres_from = 8;
    frame.step = 3, frame.time = 0.25;
    frame.id = {7, 8};
    frame.x = {Vec3(1, 0, 0), Vec3(9, 0, 0)};
    frame.radius = {2, 1};
    frame.u = {Vec3(0, 0, 5), Vec3(1, 0, 0)};
    frame.omega = {Vec3(3, 0, 0), Vec3(0, 7, 0)};
    const double half = std::numbers::pi / 4;  // of a quarter turn about y
    frame.orientation = {{std::cos(half), 0, std::sin(half), 0}, {1, 0, 0, 0}};
    frame.material = {1, 0};
  }
};

TEST(FrameOfBalls, HasAThingForEachBallThatMovesAsItsClumpTurns) {
  const Mixed mixed;
  const Frame balls = frame_of_balls(mixed.frame, mixed.shapes);
  EXPECT_EQ(balls.id, (std::vector<std::int64_t>{7, 7, 8}));
  EXPECT_EQ(balls.material, (std::vector<std::int64_t>{1, 1, 0}));
  EXPECT_EQ(balls.radius, (std::vector<double>{1, 1, 1}));
  EXPECT_EQ(balls.step, 3);
  EXPECT_EQ(balls.time, 0.25);
  ASSERT_EQ(balls.x.size(), 3U);
  EXPECT_NEAR((balls.x[0] - Vec3(1, 0, 1)).norm(), 0, 1e-12);
  EXPECT_NEAR((balls.u[0] - Vec3(0, -3, 5)).norm(), 0, 1e-12);  // (3, 0, 0) x (0, 0, 1)
  EXPECT_NEAR((balls.u[1] - Vec3(0, 3, 5)).norm(), 0, 1e-12);
  EXPECT_EQ(balls.u[2], Vec3(1, 0, 0));
  EXPECT_EQ(balls.omega[1], Vec3(3, 0, 0));
}

TEST(FrameOfBalls, GivesALammpsDumpIdsOfItsOwnAndMolecules) {
  const Mixed mixed;
  const std::string text = lammps_dump(frame_of_balls(mixed.frame, mixed.shapes), 2);
  EXPECT_NE(text.find("ITEM: ATOMS id mol type radius"), std::string::npos);
  EXPECT_NE(text.find("\n15 8 2 1 "), std::string::npos) << text;
  EXPECT_NE(text.find("\n16 8 2 1 "), std::string::npos) << text;
  EXPECT_NE(text.find("\n17 9 1 1 "), std::string::npos) << text;
  // As it was without clumps.
  EXPECT_NE(lammps_dump(mixed.frame)
                .find("type radius x y z vx vy vz omegax omegay omegaz quatw quati quatj "
                      "quatk\n8 2 2 1 0 0 0 0 5 3 0 0 "),
            std::string::npos);
}

TEST(LammpsDump, OfAFrameWithoutGrainsHasTheColumnsOfTheOthersAndABox) {
  const Mixed mixed;
  const std::string text = lammps_dump(Frame{}, 1, mixed.frame);
  EXPECT_NE(text.find("ITEM: NUMBER OF ATOMS\n0\n"), std::string::npos) << text;
  EXPECT_NE(text.find("ff ff ff\n0 1\n0 1\n0 1\n"), std::string::npos) << text;
  EXPECT_NE(text.find("z vx vy vz omegax omegay omegaz quatw quati quatj quatk\n"), std::string::npos)
      << text;
}

}  // namespace
}  // namespace talus::io::ball_frames_test
