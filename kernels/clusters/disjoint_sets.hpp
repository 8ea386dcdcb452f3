#pragma once

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <vector>

#include "kernels/bodies/index.hpp"

namespace talus {

/// Disjoint sets of 0 .. n - 1, each named by its lowest member.
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), 0); }

  std::int32_t find(std::int32_t k) {
    while (parent_[at(k)] != k) {
      parent_[at(k)] = parent_[at(parent_[at(k)])];
      k = parent_[at(k)];
    }
    return k;
  }
  void join(std::int32_t a, std::int32_t b) {
    a = find(a);
    b = find(b);
    parent_[at(std::max(a, b))] = std::min(a, b);
  }

 private:
  std::vector<std::int32_t> parent_;
};

}  // namespace talus
