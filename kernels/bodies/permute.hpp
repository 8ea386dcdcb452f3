#pragma once

#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "kernels/bodies/types.hpp"

namespace talus {

/// New entry k is the old entry order[k]; an empty array stays empty.
template <class T>
void permute(std::vector<T>& values, std::span<const Slot> order) {
  if (values.empty()) return;
  std::vector<T> moved(order.size());
  for (std::size_t k = 0; k < order.size(); ++k) moved[k] = values[static_cast<std::size_t>(order[k])];
  values.swap(moved);
}

/// The same, one entry at a time along the cycles of `order`, a permutation of 0..n-1: for arrays that memory
/// has no room for twice.
template <class T>
void permute_in_place(std::vector<T>& values, std::span<const Slot> order) {
  std::vector<bool> placed(values.size(), false);
  for (std::size_t begin = 0; begin < values.size(); ++begin) {
    if (placed[begin]) continue;
    const T first = values[begin];
    std::size_t to = begin;
    for (auto from = static_cast<std::size_t>(order[to]); from != begin;
         from = static_cast<std::size_t>(order[to])) {
      values[to] = values[from];
      placed[to] = true;
      to = from;
    }
    values[to] = first;
    placed[to] = true;
  }
}

}  // namespace talus
