#pragma once

#include <cstddef>
#include <vector>

namespace talus {

/// Gives the memory of an array back now. `values = {}` would not: it assigns an empty list and keeps the
/// room.
template <class T>
void release(std::vector<T>& values) {
  std::vector<T>().swap(values);
}

/// Makes room for `size` entries that mean nothing yet. Where they do not fit, resize() would copy the old
/// ones, and leave room for as many more.
template <class T>
void resize_anew(std::vector<T>& values, std::size_t size) {
  if (size > values.capacity()) release(values);
  values.resize(size);
}

}  // namespace talus
