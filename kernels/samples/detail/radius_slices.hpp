#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <limits>

namespace talus::detail {

/// Radii cut in halves again and again: nodes of a binary tree, of which node k has the halves 2 k and 2 k +
/// 1; node 1 holds all radii.
class RadiusSlices {
 public:
  static constexpr std::size_t levels = 7, leaves = std::size_t{1} << (levels - 1), end = 2 * leaves;

  RadiusSlices(double smallest, double largest) : smallest_(smallest), range_(largest - smallest) {}

  static bool is_leaf(std::size_t slice) { return slice >= leaves; }
  /// The slice holds the radii from here to `high` [m].
  double low(std::size_t slice) const {
    const std::size_t row = std::bit_floor(slice);  // nodes in the row of this one
    return smallest_ + range_ * (static_cast<double>(slice - row) / static_cast<double>(row));
  }
  /// The last slices have no end.
  double high(std::size_t slice) const {
    return std::has_single_bit(slice + 1) ? std::numeric_limits<double>::infinity() : low(slice + 1);
  }
  /// The slices that hold a radius, down to its leaf.
  std::array<std::size_t, levels> around(double radius) const {
    std::array<std::size_t, levels> slices{1};
    for (std::size_t level = 1; level < levels; ++level) {
      const std::size_t upper = 2 * slices[level - 1] + 1;
      slices[level] = radius >= low(upper) ? upper : upper - 1;
    }
    return slices;
  }

 private:
  double smallest_, range_;
};

}  // namespace talus::detail
