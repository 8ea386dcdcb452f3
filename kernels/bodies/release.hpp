#pragma once

#include <vector>

namespace talus {

/// Gives the memory of an array back now. `values = {}` would not: it assigns an empty list and keeps the
/// room.
template <class T>
void release(std::vector<T>& values) {
  std::vector<T>().swap(values);
}

}  // namespace talus
