#pragma once

/// The registry of partitioners. One more is one source file in partition/partitioners/, its declaration here
/// and its line in partitioners.cpp; the scene's choices, the reference and `talus partition` come from
/// there.

#include "kernels/registry.hpp"
#include "partition/detail/bisection.hpp"
#include "partition/partitioner.hpp"

namespace talus {

/// What is to be cut: checked arguments of make_partition.
struct Cutting {
  const PartitionPoints& points;
  const PartitionOptions& options;
  const Partition* previous;  ///< in force, of as many subdomains; else null
  const Reduction& reduction;
};

/// What is behind a line of the registry.
struct Partitioner {
  /// Fills the tree or the table of a partition whose frame and number of subdomains are set. Collective.
  /// Throws as make_partition does.
  void (*cut)(const Cutting& cutting, Partition& partition);
  bool takes_boxes = false;   ///< reads PartitionOptions::boxes
  bool reads_halves = false;  ///< reads PartitionPoints::half
};

extern const Partitioner automatic_partitioner;
extern const Partitioner boxes_partitioner;
extern const Partitioner fitted_partitioner;
extern const Partitioner rcb_partitioner;
extern const Partitioner metis_partitioner;
extern const Partitioner hilbert_partitioner;

using PartitionerRegistry = Registry<PartitionKind, const Partitioner*>;
const PartitionerRegistry& partitioner_registry();

/// Boxes per axis as the options give them, or else box_factors of the frame. Throws std::invalid_argument
/// when their product is not the number of subdomains.
std::array<std::int32_t, 3> boxes_of(const PartitionOptions& options, const IntegerFrame& frame);

/// The points as those read them who cut along planes. Collective.
detail::WeightedPoints weighted_points(const Cutting& cutting, const IntegerFrame& frame);

}  // namespace talus
