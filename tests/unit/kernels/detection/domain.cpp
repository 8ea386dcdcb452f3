#include "kernels/detection/domain.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace talus {
namespace {

TEST(Domain, SeparationBetweenWallsIsThePlainDifferenceToTheBit) {
  const Vec3 a(0.1, -3e7, 1e-300), b(0.3, 5e-9, -1e-308);
  const Domain domain;
  EXPECT_EQ(domain.separation(a, b), Vec3(a - b));
  EXPECT_EQ(domain.separation(b, a), -domain.separation(a, b));
  EXPECT_EQ(domain.midpoint(a, b), Vec3(0.5 * (a + b)));
  EXPECT_EQ(domain.wrap(a), a);
}

TEST(Domain, StrainIsTheLogarithmOfTheLengths) {
  const Domain domain;
  EXPECT_DOUBLE_EQ(domain.strain(2.0, 1.0), std::log(2.0));
  EXPECT_DOUBLE_EQ(domain.strain(0.5, 1.0), -std::log(2.0));
  EXPECT_EQ(domain.strain(0.0, 1.0), 0) << "no two walls bound the axis now";
  EXPECT_EQ(domain.strain(1.0, 0.0), 0) << "nor when the stage began";
}

TEST(Domain, VolumeIsThatOfTheBoxOfWallsOrNone) {
  std::vector<Wall> walls;
  for (Eigen::Index axis = 0; axis < 3; ++axis)
    for (const double sign : {1.0, -1.0}) {
      Wall wall;
      wall.normal = sign * Vec3::Unit(axis);
      wall.point = (sign < 0 ? 2.0 + static_cast<double>(axis) : 0.0) * Vec3::Unit(axis);
      walls.push_back(wall);
    }
  const Domain domain;
  EXPECT_EQ(domain.lengths(walls), Vec3(2, 3, 4));
  EXPECT_EQ(domain.volume(walls), 24);
  walls.pop_back();
  EXPECT_EQ(domain.volume(walls), 0);
  EXPECT_EQ(domain.lengths(walls), Vec3(2, 3, 0));
}

}  // namespace
}  // namespace talus
