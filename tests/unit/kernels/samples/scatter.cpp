#include "kernels/samples/scatter.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace talus {
namespace {

/// The least gap of two spheres, over 3^3 images of each, by looking at all pairs.
double least_gap(const std::vector<Vec3>& x, const std::vector<double>& radii, const Mat3& edges) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t a = 0; a < x.size(); ++a)
    for (std::size_t b = a; b < x.size(); ++b)
      for (int i = -1; i <= 1; ++i)
        for (int j = -1; j <= 1; ++j)
          for (int k = -1; k <= 1; ++k)
            if (const Vec3 d = x[a] - x[b] + edges * Vec3(i, j, k); a != b || d.norm() > 0)
              least = std::min(least, d.norm() - radii[a] - radii[b]);
  return least;
}

std::vector<double> three_sizes(std::size_t count) {
  std::vector<double> radii;
  for (std::size_t k = 0; k < count; ++k) radii.push_back(k % 10 == 3 ? 0.4 : k % 3 == 0 ? 0.2 : 0.1);
  return radii;
}

TEST(Scatter, PutsNoSphereIntoAnotherAcrossFacesOfAShearedCell) {
  const Vec3 lengths(4, 5, 6), shears(0, 2.2, -1.4), low(-1, 3, 0);
  Mat3 edges = Mat3(lengths.asDiagonal());
  edges(0, 2) = shears[1];
  edges(1, 2) = shears[2];
  const std::vector<double> radii = three_sizes(400);
  const std::vector<Vec3> x =
      scatter(radii, {low, low + lengths, periodic_domain(lengths, low, shears), 3, 0});
  EXPECT_GE(least_gap(x, radii, edges), 0);
  EXPECT_LT(least_gap(x, radii, edges), 0.05) << "some are close: the search is not blind";
  Vec3 mean = Vec3::Zero();
  for (const Vec3& place : x) mean += place / static_cast<double>(x.size());
  for (const Eigen::Index axis : {0, 1, 2})
    EXPECT_NEAR(mean[axis], low[axis] + lengths[axis] / 2, 4 * lengths[axis] / std::sqrt(12 * 400.0));
}

TEST(Scatter, LeavesOutWhatStandsThereAlsoAcrossFaces) {
  const Vec3 lengths(4, 5, 6), shears(1.8, 2.2, -1.4), low(-1, 3, 0);
  const Domain domain = periodic_domain(lengths, low, shears);
  Mat3 edges = Mat3(lengths.asDiagonal());
  edges(0, 1) = shears[0];
  edges(0, 2) = shears[1];
  edges(1, 2) = shears[2];
  // Larger and smaller ones than those to come, some in another image.
  StandingGrains stand{{low, low + 0.5 * lengths, low + Vec3(9, 0.1, 14)}, {1.2, 0.05, 0.6}};
  const std::vector<double> radii = three_sizes(300);
  std::vector<Vec3> all = scatter(radii, {low, low + lengths, domain, 3, 1}, stand);
  std::vector<double> sizes = radii;
  for (std::size_t k = 0; k < stand.x.size(); ++k) {
    all.push_back(domain.wrap(stand.x[k]));
    sizes.push_back(stand.radius[k]);
  }
  EXPECT_GE(least_gap(all, sizes, edges), 0);
  // In a box beside walls, too, where some stand behind its end.
  stand = {{{2, 2, -0.3}, {2, 2, 7}}, {1, 3}};
  std::vector<Vec3> boxed = scatter(three_sizes(100), {Vec3::Zero(), {4, 4, 5}, {}, 1, 0}, stand);
  for (std::size_t k = 0; k < boxed.size(); ++k)
    for (std::size_t s = 0; s < stand.x.size(); ++s)
      EXPECT_GE((boxed[k] - stand.x[s]).norm(), three_sizes(100)[k] + stand.radius[s]);
}

TEST(Scatter, StaysInsideAlongAxesThatDoNotRepeat) {
  const std::vector<double> radii = three_sizes(200);
  const std::vector<Vec3> x = scatter(radii, {Vec3::Zero(), {4, 4, 3}, periodic_domain({4, 4, 0}), 1, 0});
  bool across = false;
  for (std::size_t k = 0; k < x.size(); ++k) {
    EXPECT_GE(x[k][2], radii[k]);
    EXPECT_LE(x[k][2], 3 - radii[k]);
    across = across || x[k][0] < radii[k];
  }
  EXPECT_TRUE(across) << "some stand in a face";
}

TEST(Scatter, FollowsFromSeedAndStream) {
  const std::vector<double> radii = three_sizes(50);
  const ScatterBox box{Vec3::Zero(), {4, 4, 4}, periodic_domain({4, 4, 4}), 1, 0};
  ScatterBox seed = box, stream = box;
  seed.seed = 2;
  stream.stream = 1;
  EXPECT_EQ(scatter(radii, box), scatter(radii, box));
  EXPECT_NE(scatter(radii, box), scatter(radii, seed));
  EXPECT_NE(scatter(radii, box), scatter(radii, stream));
}

TEST(Scatter, SaysWhenThereIsNoRoom) {
  const ScatterBox box{Vec3::Zero(), {2, 2, 2}, periodic_domain({2, 2, 2}), 1, 0};
  EXPECT_THROW(scatter(std::vector<double>(100, 0.5), box), std::invalid_argument);
}

}  // namespace
}  // namespace talus
