#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "partition/partitioner.hpp"

namespace talus::detail {

using Coordinates = std::array<std::uint32_t, 3>;

/// Key of a point in a cut across `axis`: 63 bits, that axis first, then the next two.
std::uint64_t cut_key(const Coordinates& q, std::int32_t axis);

/// Points as a partitioner sees them.
struct WeightedPoints {
  std::vector<Coordinates> q;
  std::span<const std::int32_t> weight;  ///< empty: all 1
  std::int64_t heaviest = 1;             ///< largest weight on any rank

  std::int64_t weight_of(std::size_t k) const { return weight.empty() ? 1 : weight[k]; }
};

/// n_x x n_y x n_z equal boxes as a tree.
CutTree regular_boxes(const std::array<std::int32_t, 3>& boxes);

/// The same tree with each plane shifted, within its own box, to the weighted quantile: slabs across x, in
/// each slab columns across y, in each column boxes across z.
CutTree fitted_boxes(const WeightedPoints& points, const std::array<std::int32_t, 3>& boxes,
                     const Reduction& reduction);

/// Recursive bisection into n parts, each cut across the axis along which the weights spread most. `previous`
/// may be null; its axis is kept while its spread (standard deviation, in metres) is at least 0.9 of the
/// largest.
CutTree recursive_bisection(const WeightedPoints& points, std::int32_t n, const IntegerFrame& frame,
                            const CutTree* previous, const Reduction& reduction);

/// Subdomain of a point: the leaf of the tree.
std::int32_t leaf_of(const CutTree& tree, const Coordinates& q);

}  // namespace talus::detail
