#include "partition/partitioners.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace talus {

namespace {

/// In the order in which users read of them.
constexpr PartitionerRegistry::Item partitioners[] = {
    named<PartitionKind>("auto", "boxes where they are balanced or given, else rcb", &automatic_partitioner),
    named<PartitionKind>("boxes", "equal boxes", &boxes_partitioner),
    named<PartitionKind>("fitted", "boxes of equal work", &fitted_partitioner),
    named<PartitionKind>("rcb", "recursive bisection at weighted medians", &rcb_partitioner),
    named<PartitionKind>("metis", "a graph of cells, cut by METIS", &metis_partitioner),
    named<PartitionKind>("hilbert", "stretches of equal work of a Hilbert curve", &hilbert_partitioner),
};

std::int64_t heaviest(const PartitionPoints& points, const Reduction& reduction) {
  std::array<double, 1> most{points.weight.empty() ? 1.0 : 0.0};
  for (std::int32_t weight : points.weight) most[0] = std::max(most[0], static_cast<double>(weight));
  reduction.max(most);
  return static_cast<std::int64_t>(most[0]);
}

}  // namespace

const PartitionerRegistry& partitioner_registry() {
  static constexpr PartitionerRegistry registry("partitioner", partitioners);
  return registry;
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

detail::WeightedPoints weighted_points(const Cutting& cutting, const IntegerFrame& frame) {
  const PartitionPoints& points = cutting.points;
  detail::WeightedPoints weighted{{}, points.weight, heaviest(points, cutting.reduction)};
  weighted.q.reserve(points.x.size());
  for (const Vec3& point : points.x) weighted.q.push_back(frame.coordinates(point));
  return weighted;
}

}  // namespace talus
