#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "kernels/bodies/types.hpp"

namespace talus::detail {

/// Grains by cubic cells; layers are added as the sample grows.
class GrowingCells {
 public:
  GrowingCells(double side, double length_x, double length_y)
      : side_(side),
        nx_(static_cast<std::int64_t>(length_x / side) + 1),
        ny_(static_cast<std::int64_t>(length_y / side) + 1) {}

  void add(std::int32_t grain, const Vec3& x) {
    const std::int64_t layer = index(x[2]);
    if (static_cast<std::size_t>((layer + 1) * nx_ * ny_) > head_.size())
      head_.resize(static_cast<std::size_t>((layer + 1) * nx_ * ny_), none);
    std::int32_t& head = head_[cell(index(x[0]), index(x[1]), layer)];
    next_.push_back(head);
    head = grain;
  }

  /// visit(grain) for every grain whose centre may lie within `reach` of x, until it returns false.
  template <class Visit>
  void visit_near(const Vec3& x, double reach, const Visit& visit) const {
    const std::int64_t layers = static_cast<std::int64_t>(head_.size()) / (nx_ * ny_);
    const auto low = [&](int axis) { return std::max<std::int64_t>(index(x[axis] - reach), 0); };
    const auto high = [&](int axis, std::int64_t n) { return std::min(index(x[axis] + reach), n - 1); };
    for (std::int64_t k = low(2); k <= high(2, layers); ++k)
      for (std::int64_t j = low(1); j <= high(1, ny_); ++j)
        for (std::int64_t i = low(0); i <= high(0, nx_); ++i)
          for (std::int32_t g = head_[cell(i, j, k)]; g != none; g = next_[static_cast<std::size_t>(g)])
            if (!visit(g)) return;
  }

 private:
  static constexpr std::int32_t none = -1;
  std::int64_t index(double x) const { return static_cast<std::int64_t>(std::floor(x / side_)); }
  std::size_t cell(std::int64_t i, std::int64_t j, std::int64_t k) const {
    return static_cast<std::size_t>((k * ny_ + j) * nx_ + i);
  }

  double side_;
  std::int64_t nx_, ny_;
  std::vector<std::int32_t> head_, next_;
};

}  // namespace talus::detail
