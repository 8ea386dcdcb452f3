#include <gtest/gtest.h>

#include "partition/partitioners.hpp"

namespace talus {
namespace {

Partition along_the_curve(const PartitionPoints& points, std::int32_t subdomains) {
  PartitionOptions options;
  options.kind = partition_kind("hilbert");
  options.subdomains = subdomains;
  return make_partition(points, options);
}

/// One point at the centre of each of 8 x 8 x 8 cubes.
PartitionPoints lattice() {
  PartitionPoints points;
  for (int k = 0; k < 512; ++k) points.x.emplace_back(k % 8, k / 8 % 8, k / 64);
  return points;
}

TEST(Hilbert, CurveVisitsEveryPlaceAndStepsToANeighbour) {
  const PartitionPoints points = lattice();
  const std::vector<SubdomainId> number = subdomains_of(along_the_curve(points, 512), points.x);
  std::vector<Vec3> visited(512, Vec3::Constant(-1));
  for (std::size_t k = 0; k < number.size(); ++k) visited[number[k].at()] = points.x[k];
  for (std::size_t k = 0; k < visited.size(); ++k) {
    ASSERT_GE(visited[k][0], 0) << "place " << k << " of the curve has no point, another has two";
    const double step = k > 0 ? (visited[k] - visited[k - 1]).norm() : 1;
    EXPECT_EQ(step, 1) << k;
  }
}

TEST(Hilbert, StretchesHaveEqualWeightToTheHeaviestCell) {
  PartitionPoints points = lattice();
  for (std::size_t k = 0; k < points.x.size(); ++k)
    points.weight.push_back(1 + static_cast<std::int32_t>(k * 7 % 5));
  std::int64_t sum = 0;
  for (const std::int32_t weight : points.weight) sum += weight;
  for (const std::int32_t n : {2, 7, 16})
    for (const std::int64_t weight : weight_per_subdomain(along_the_curve(points, n), points))
      EXPECT_NEAR(static_cast<double>(weight), static_cast<double>(sum) / n, 5) << n;
}

TEST(Hilbert, EightSubdomainsOfACubeAreItsOctants) {
  const PartitionPoints points = lattice();
  const std::vector<SubdomainId> subdomain = subdomains_of(along_the_curve(points, 8), points.x);
  for (std::size_t k = 0; k < points.x.size(); ++k)
    for (std::size_t j = 0; j < k; ++j) {
      const bool one_octant = (points.x[k] / 4).array().floor().isApprox((points.x[j] / 4).array().floor());
      ASSERT_EQ(subdomain[k] == subdomain[j], one_octant) << k << " and " << j;
    }
}

}  // namespace
}  // namespace talus
