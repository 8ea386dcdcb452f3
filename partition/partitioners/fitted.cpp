/// n_x x n_y x n_z boxes with their planes shifted to equal weights, column by column.

#include "partition/partitioners.hpp"

namespace talus {
namespace {

void cut_fitted(const Cutting& cutting, Partition& partition) {
  partition.tree = detail::fitted_boxes(weighted_points(cutting, partition.frame),
                                        boxes_of(cutting.options, partition.frame), cutting.reduction);
}

}  // namespace

const Partitioner fitted_partitioner{cut_fitted, true};

}  // namespace talus
