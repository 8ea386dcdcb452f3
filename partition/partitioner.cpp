#include "partition/partitioner.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <string>

#include "partition/partitioners.hpp"

namespace talus {

namespace {

void check_weights(const PartitionPoints& points, const Reduction& reduction) {
  std::array<std::int64_t, 2> sums{0, 0};  // total, negative ones
  for (std::int32_t weight : points.weight) {
    sums[0] += weight;
    sums[1] += weight < 0;
  }
  if (points.weight.empty()) sums[0] = static_cast<std::int64_t>(points.x.size());
  reduction.sum(sums);
  if (sums[1] > 0 || sums[0] > std::numeric_limits<std::int32_t>::max())
    throw std::invalid_argument("partition: weights must be >= 0 and their sum below 2^31; " +
                                std::to_string(sums[1]) + " are negative, the sum is " +
                                std::to_string(sums[0]));
}

}  // namespace

bool cuts_boxes(PartitionKind kind) {
  return partitioner_registry().of(kind).make->takes_boxes;
}

std::string_view name_of(PartitionKind kind) {
  return kind.name();
}

PartitionKind partition_kind(std::string_view name) {
  return partitioner_registry().named(name).kind;
}

PartitionPoints candidate_points(std::span<const Vec3> x, std::span<const GrainPair> grain_pairs,
                                 std::span<const WallPair> wall_pairs, const Domain& domain) {
  PartitionPoints points;
  points.x.reserve(grain_pairs.size() + wall_pairs.size());
  points.half.reserve(grain_pairs.size() + wall_pairs.size());
  for (const GrainPair& pair : grain_pairs) {
    const Vec3 &first = x[static_cast<std::size_t>(pair.first)],
               &second = x[static_cast<std::size_t>(pair.second)];
    points.x.push_back(domain.midpoint(first, second));
    points.half.push_back(0.5 * domain.separation(first, second));
  }
  for (const WallPair& pair : wall_pairs) {
    points.x.push_back(x[static_cast<std::size_t>(pair.body)]);
    points.half.push_back(Vec3::Zero());
  }
  return points;
}

SubdomainId Partition::subdomain_of(const Vec3& point) const {
  if (subdomains == 1) return SubdomainId(0);
  const auto q = frame.coordinates(point);
  return SubdomainId(by_table() ? table.subdomain[table.cell_of(q)] : detail::leaf_of(tree, q));
}

Partition make_partition(const PartitionPoints& points, const PartitionOptions& options,
                         const Reduction& reduction) {
  if (options.subdomains < 1)
    throw std::invalid_argument("partition: " + std::to_string(options.subdomains) +
                                " subdomains; there must be at least 1");
  check_weights(points, reduction);
  const Partition* previous = options.previous;
  if (previous != nullptr && previous->subdomains != options.subdomains) previous = nullptr;

  Partition partition;
  partition.subdomains = options.subdomains;
  partition.kind = options.kind;
  partition.frame = make_frame(points.x, reduction);
  partitioner_registry().of(options.kind).make->cut({points, options, previous, reduction}, partition);
  return partition;
}

std::vector<SubdomainId> subdomains_of(const Partition& partition, std::span<const Vec3> points) {
  std::vector<SubdomainId> result;
  result.reserve(points.size());
  for (const Vec3& point : points) result.push_back(partition.subdomain_of(point));
  return result;
}

std::vector<std::int64_t> weight_per_subdomain(const Partition& partition, const PartitionPoints& points,
                                               const Reduction& reduction) {
  std::vector<std::int64_t> weights(static_cast<std::size_t>(partition.subdomains), 0);
  for (std::size_t k = 0; k < points.x.size(); ++k)
    weights[partition.subdomain_of(points.x[k]).at()] += points.weight.empty() ? 1 : points.weight[k];
  reduction.sum(weights);
  return weights;
}

double imbalance(std::span<const std::int64_t> weights) {
  std::int64_t sum = 0, largest = 0;
  for (std::int64_t weight : weights) {
    sum += weight;
    largest = std::max(largest, weight);
  }
  if (sum == 0) return 0;
  return static_cast<double>(largest) * static_cast<double>(weights.size()) / static_cast<double>(sum) - 1;
}

std::array<std::int32_t, 3> box_factors(std::int32_t n, const Vec3& lengths) {
  std::array<std::int32_t, 3> best{1, 1, n};
  double least = std::numeric_limits<double>::infinity();
  for (std::int32_t x = 1; x <= n; ++x) {
    if (n % x != 0) continue;
    for (std::int32_t y = 1; y <= n / x; ++y) {
      if (n / x % y != 0) continue;
      const std::int32_t z = n / x / y;
      const double area = (x - 1) * lengths[1] * lengths[2] + (y - 1) * lengths[2] * lengths[0] +
                          (z - 1) * lengths[0] * lengths[1];
      if (area >= least) continue;
      least = area;
      best = {x, y, z};
    }
  }
  return best;
}

std::size_t memory_used(const Partition& partition) {
  return partition.tree.cuts.size() * sizeof(CutTree::Cut) +
         partition.table.subdomain.size() * sizeof(std::int32_t);
}

}  // namespace talus
