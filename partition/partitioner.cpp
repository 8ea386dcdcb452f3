#include "partition/partitioner.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <string>

#include "kernels/detection/domain.hpp"
#include "partition/detail/bisection.hpp"
#include "partition/detail/cell_graph.hpp"

namespace talus {

namespace {

/// Cells with weight per subdomain that METIS works on. Of 90 to 2000 none gave a better cut; the fewer, the
/// faster and the smaller the sums over ranks. Parts are balanced to about one cell.
constexpr std::int64_t cells_per_subdomain = 128;

constexpr std::array<std::string_view, 5> names{"auto", "boxes", "fitted", "rcb", "metis"};

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

std::int64_t heaviest(const PartitionPoints& points, const Reduction& reduction) {
  std::array<double, 1> most{points.weight.empty() ? 1.0 : 0.0};
  for (std::int32_t weight : points.weight) most[0] = std::max(most[0], static_cast<double>(weight));
  reduction.max(most);
  return static_cast<std::int64_t>(most[0]);
}

std::array<std::int32_t, 3> boxes_of(const PartitionOptions& options, const IntegerFrame& frame) {
  const auto& boxes = options.boxes;
  if (boxes == std::array<std::int32_t, 3>{}) return box_factors(options.subdomains, frame.lengths);
  const auto [x, y, z] = boxes;
  if (x < 1 || y < 1 || z < 1 || std::int64_t{x} * y * z != options.subdomains)
    throw std::invalid_argument("partition: " + std::to_string(x) + " x " + std::to_string(y) + " x " +
                                std::to_string(z) + " boxes are not " + std::to_string(options.subdomains) +
                                " subdomains");
  return boxes;
}

}  // namespace

std::string_view name_of(PartitionKind kind) {
  return names[static_cast<std::size_t>(kind)];
}

PartitionKind partition_kind(std::string_view name) {
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end())
    throw std::invalid_argument("partitioner \"" + std::string(name) +
                                "\" is none of auto, boxes, fitted, rcb, metis");
  return static_cast<PartitionKind>(found - names.begin());
}

PartitionPoints candidate_points(std::span<const Vec3> x, std::span<const GrainPair> grain_pairs,
                                 std::span<const WallPair> wall_pairs) {
  PartitionPoints points;
  points.x.reserve(grain_pairs.size() + wall_pairs.size());
  points.half.reserve(grain_pairs.size() + wall_pairs.size());
  for (const GrainPair& pair : grain_pairs) {
    const Vec3 &first = x[static_cast<std::size_t>(pair.first)],
               &second = x[static_cast<std::size_t>(pair.second)];
    points.x.push_back(Domain{}.midpoint(first, second));
    points.half.push_back(0.5 * Domain{}.separation(first, second));
  }
  for (const WallPair& pair : wall_pairs) {
    points.x.push_back(x[static_cast<std::size_t>(pair.body)]);
    points.half.push_back(Vec3::Zero());
  }
  return points;
}

std::int32_t Partition::subdomain_of(const Vec3& point) const {
  if (subdomains == 1) return 0;
  const auto q = frame.coordinates(point);
  return kind == PartitionKind::metis ? table.subdomain[table.cell_of(q)] : detail::leaf_of(tree, q);
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
  if (options.kind == PartitionKind::automatic && previous != nullptr &&
      previous->kind != PartitionKind::boxes)
    partition.kind = previous->kind;  // a change of partitioner would move nearly every body
  if (partition.kind == PartitionKind::automatic || partition.kind == PartitionKind::boxes) {
    partition.kind = PartitionKind::boxes;
    partition.tree = detail::regular_boxes(boxes_of(options, partition.frame));
    if (options.kind == PartitionKind::boxes ||
        imbalance(weight_per_subdomain(partition, points, reduction)) <= options.auto_imbalance)
      return partition;
    partition.kind = PartitionKind::rcb;
  }
  if (partition.kind == PartitionKind::metis) {
    const auto graph = detail::build_cell_graph(points, partition.frame,
                                                cells_per_subdomain * options.subdomains, reduction);
    partition.table = detail::cut_cell_graph(graph, options.subdomains, reduction);
    if (previous != nullptr)
      detail::keep_numbers(partition.table, *previous, points, partition.frame, options.subdomains,
                           reduction);
    return partition;
  }
  detail::WeightedPoints weighted{{}, points.weight, heaviest(points, reduction)};
  weighted.q.reserve(points.x.size());
  for (const Vec3& point : points.x) weighted.q.push_back(partition.frame.coordinates(point));
  if (partition.kind == PartitionKind::fitted) {
    partition.tree = detail::fitted_boxes(weighted, boxes_of(options, partition.frame), reduction);
  } else {
    const bool same = previous != nullptr && previous->kind == PartitionKind::rcb;
    partition.tree = detail::recursive_bisection(weighted, options.subdomains, partition.frame,
                                                 same ? &previous->tree : nullptr, reduction);
  }
  return partition;
}

std::vector<std::int32_t> subdomains_of(const Partition& partition, std::span<const Vec3> points) {
  std::vector<std::int32_t> result;
  result.reserve(points.size());
  for (const Vec3& point : points) result.push_back(partition.subdomain_of(point));
  return result;
}

std::vector<std::int64_t> weight_per_subdomain(const Partition& partition, const PartitionPoints& points,
                                               const Reduction& reduction) {
  std::vector<std::int64_t> weights(static_cast<std::size_t>(partition.subdomains), 0);
  for (std::size_t k = 0; k < points.x.size(); ++k)
    weights[static_cast<std::size_t>(partition.subdomain_of(points.x[k]))] +=
        points.weight.empty() ? 1 : points.weight[k];
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
