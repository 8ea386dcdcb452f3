/// n_x x n_y x n_z equal boxes: the paper's regular grid.

#include "partition/partitioners.hpp"

namespace talus {
namespace {

void cut_boxes(const Cutting& cutting, Partition& partition) {
  partition.tree = detail::regular_boxes(boxes_of(cutting.options, partition.frame));
}

}  // namespace

const Partitioner boxes_partitioner{cut_boxes, true};

}  // namespace talus
