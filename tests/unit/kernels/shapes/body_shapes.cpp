/// Shapes of bodies against integrals over a fine grid of points, which know nothing of balls' moments.

#include "kernels/shapes/body_shapes.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace talus {
namespace {

struct Integrals {
  double volume = 0;
  Vec3 centre = Vec3::Zero();
  Mat3 inertia = Mat3::Zero();  ///< about the origin, of density 1
};

Integrals integrate(const Clump& clump, int side) {
  const double step = 2.0 / side, cell = step * step * step;
  Integrals sums;
  for (int i = 0; i < side; ++i)
    for (int j = 0; j < side; ++j)
      for (int k = 0; k < side; ++k) {
        const Vec3 p = step * (Vec3(i, j, k) + Vec3::Constant(0.5)) - Vec3::Ones();
        if (std::ranges::none_of(clump.balls,
                                 [&](const Ball& b) { return (p - b.centre).norm() < b.radius; }))
          continue;
        sums.volume += cell;
        sums.centre += cell * p;
        sums.inertia += cell * (p.squaredNorm() * Mat3::Identity() - p * p.transpose());
      }
  sums.centre /= sums.volume;
  return sums;
}

TEST(BodyShapes, HaveTheMassAndMomentsOfTheirPoints) {
  int clumps = 0;
  for (const BodyShapeEntry& entry : body_shapes()) {
    if (entry.make == nullptr) continue;
    ++clumps;
    const Clump clump = entry.make();
    const Integrals sums = integrate(clump, 120);
    EXPECT_NEAR(clump.volume, sums.volume, 5e-3 * sums.volume) << entry.name;
    EXPECT_LT(sums.centre.norm(), 1e-3) << entry.name;
    const Mat3 expected = clump.volume * Mat3(clump.inertia.asDiagonal());
    EXPECT_LT((sums.inertia - expected).norm(), 1e-2 * expected.norm()) << entry.name;
  }
  EXPECT_GT(clumps, 0);
}

TEST(BodyShapes, FillASphereOfRadiusOneAndKnowTheirSmallestBall) {
  for (const BodyShapeEntry& entry : body_shapes()) {
    if (entry.make == nullptr) continue;
    const Clump clump = entry.make();
    double reach = 0, smallest = 1;
    for (const Ball& ball : clump.balls) {
      reach = std::max(reach, ball.centre.norm() + ball.radius);
      smallest = std::min(smallest, ball.radius);
    }
    EXPECT_NEAR(reach, 1, 1e-12) << entry.name;
    EXPECT_EQ(smallest, clump.smallest) << entry.name;
  }
}

}  // namespace
}  // namespace talus
