/// Equal boxes while they are balanced, else recursive bisection; once not boxes, as before, since a change
/// of partitioner would move nearly every body.

#include "partition/partitioners.hpp"

namespace talus {
namespace {

void cut_with(PartitionKind kind, const Cutting& cutting, Partition& partition) {
  partition.kind = kind;
  partitioner_registry().of(kind).make->cut(cutting, partition);
}

void cut_automatic(const Cutting& cutting, Partition& partition) {
  if (cutting.previous != nullptr && cutting.previous->kind != PartitionKind::boxes)
    return cut_with(cutting.previous->kind, cutting, partition);
  cut_with(PartitionKind::boxes, cutting, partition);
  const auto weights = weight_per_subdomain(partition, cutting.points, cutting.reduction);
  if (imbalance(weights) > cutting.options.auto_imbalance) cut_with(PartitionKind::rcb, cutting, partition);
}

}  // namespace

const Partitioner automatic_partitioner{cut_automatic, true};

}  // namespace talus
