// Which subdomains lie within a distance of a point, by every partitioner there is.

#include "partition/halo.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "partition/partitioners.hpp"

namespace talus::halo_test {
namespace {

TEST(SubdomainsWithin, HoldThoseOfAllPointsThatNearByEveryPartitioner) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> place(0, 1);
  const auto point = [&] { return Vec3(place(random), place(random), place(random)); };
  PartitionPoints points;
  for (int k = 0; k < 500; ++k) points.x.push_back(point());
  points.half.assign(points.x.size(), Vec3(0.01, 0, 0));
  for (const auto& line : partitioner_registry())
    for (const std::int32_t subdomains : {1, 2, 6, 12}) {
      PartitionOptions options;
      options.kind = line.kind;
      options.subdomains = subdomains;
      const Partition partition = make_partition(points, options);
      for (int trial = 0; trial < 50; ++trial) {
        const Vec3 centre = point();
        const double distance = 0.3 * place(random);
        const std::vector<SubdomainId> found = subdomains_within(partition, centre, distance);
        EXPECT_TRUE(std::is_sorted(found.begin(), found.end()));
        for (int near = 0; near < 20; ++near) {
          const Vec3 by = distance * (2 * point() - Vec3::Ones());
          EXPECT_TRUE(std::ranges::binary_search(found, partition.subdomain_of(centre + by)))
              << line.name << ' ' << subdomains;
        }
      }
    }
}

}  // namespace
}  // namespace talus::halo_test
