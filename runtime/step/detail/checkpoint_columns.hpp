#pragma once

/// Columns of a checkpoint, to and from the arrays of a rank.

#include <bit>
#include <type_traits>
#include <vector>

#include "kernels/bodies/motion.hpp"
#include "kernels/bodies/types.hpp"

namespace talus::detail {

template <class To, class From>
std::vector<To> converted(const From& from) {
  std::vector<To> to;
  to.reserve(from.size());
  for (const auto& value : from) to.push_back(static_cast<To>(value));
  return to;
}

/// Appends the entries of a range of slots to `to`; none of a column that the scene does not have.
template <class T, class U>
void copy_run(const std::vector<T>& from, SlotRange range, std::vector<U>& to) {
  if (from.empty()) return;
  static_assert(sizeof(T) == sizeof(U) && std::is_trivially_copyable_v<U>);
  to.reserve(range.end - range.begin);
  for (std::size_t s = range.begin; s < range.end; ++s) {
    if constexpr (std::is_same_v<T, Vec3>)
      to.push_back({from[s][0], from[s][1], from[s][2]});
    else
      to.push_back(std::bit_cast<U>(from[s]));
  }
}

/// Appends a column of a checkpoint to an array of the rank.
template <class U, class T>
void append_run(const std::vector<U>& from, std::vector<T>& to) {
  for (const U& value : from) {
    if constexpr (std::is_same_v<T, Vec3>)
      to.emplace_back(value[0], value[1], value[2]);
    else
      to.push_back(std::bit_cast<T>(value));
  }
}

}  // namespace talus::detail
