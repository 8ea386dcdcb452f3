/// Recursive coordinate bisection at weighted medians. It keeps its axes from one partition to the next while
/// the spreads allow it, so that fewer bodies migrate.

#include "partition/partitioners.hpp"

namespace talus {
namespace {

void cut_rcb(const Cutting& cutting, Partition& partition) {
  const bool same = cutting.previous != nullptr && cutting.previous->kind == PartitionKind::rcb;
  partition.tree = detail::recursive_bisection(weighted_points(cutting, partition.frame),
                                               partition.subdomains, partition.frame,
                                               same ? &cutting.previous->tree : nullptr, cutting.reduction);
}

}  // namespace

const Partitioner rcb_partitioner{cut_rcb};

}  // namespace talus
