#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/graph/communicator.hpp"

namespace talus {

/// The sum over all ranks of one number per body, the same for any order: the terms are cut into integers of
/// 31 bits, relative to the largest. What is cut off is below 2^-62 of the largest term. Terms of no more
/// than 2^-990, whose scale would not be finite, are summed as 0.
class ExactSum {
 public:
  explicit ExactSum(double largest) : scale_(largest > 0x1p-990 ? std::exp2(30 - std::ilogb(largest)) : 0) {}
  void add(double term) {
    const double scaled = term * scale_, high = std::floor(scaled);
    parts_[0] += static_cast<std::int64_t>(high);
    parts_[1] += static_cast<std::int64_t>((scaled - high) * 0x1p31);
  }
  /// Collective.
  double over(const graph::Communicator& ranks) {
    ranks.sum(parts_);
    return value();
  }
  /// Several in one message. Collective.
  friend std::vector<double> all_over(std::span<ExactSum> sums, const graph::Communicator& ranks) {
    std::vector<std::int64_t> parts;
    for (const ExactSum& sum : sums) parts.insert(parts.end(), sum.parts_.begin(), sum.parts_.end());
    ranks.sum(parts);
    std::vector<double> values;
    for (std::size_t k = 0; k < sums.size(); ++k) {
      sums[k].parts_ = {parts[2 * k], parts[2 * k + 1]};
      values.push_back(sums[k].value());
    }
    return values;
  }

 private:
  double value() const {
    if (scale_ == 0) return 0;
    return (static_cast<double>(parts_[0]) + static_cast<double>(parts_[1]) * 0x1p-31) / scale_;
  }

  double scale_;
  std::array<std::int64_t, 2> parts_{};
};

}  // namespace talus
