#include "apps/study_error/study_runs.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace talus {
namespace {

TEST(StudyRuns, AGrainThatOneRunHasWrappedIsNoEdgeOfTheCellAway) {
  // Sheared: beyond the upper face the images stand 0.5 m further along x.
  const Domain cell = periodic_domain({4, 2, 0}, Vec3::Zero(), {0.5, 0, 0});
  const std::vector<Vec3> reference = {{1, 1.99, 1}, {3.99, 1, 1}, {2, 1, 0}};
  const std::vector<Vec3> run = {{0.5, 0.02, 1}, {0.03, 1, 1}, {2, 1, 0.05}};
  EXPECT_NEAR(rms_distance(run, reference, cell), std::sqrt((0.0009 + 0.0016 + 0.0025) / 3), 1e-14);
}

TEST(StudyRuns, BetweenWallsADistanceIsADifference) {
  EXPECT_EQ(rms_distance(std::vector<Vec3>{{0, 0, 5}}, std::vector<Vec3>{{3, 4, 5}}, Domain{}), 5);
  EXPECT_EQ(rms_distance({}, {}, Domain{}), 0);
}

}  // namespace
}  // namespace talus
