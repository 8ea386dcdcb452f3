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

}  // namespace talus
