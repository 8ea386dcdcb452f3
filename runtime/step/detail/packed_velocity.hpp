#pragma once

/// A body's velocity as it travels between subdomains: numbers of the record that sweeps work on, 6, or 3
/// without rotation, one body after the other.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <span>
#include <type_traits>

#include "runtime/step/detail/gluing_parts.hpp"

namespace talus::detail {

/// The numbers of one body, w behind u.
template <std::size_t Width, class Record>
using Numbers = std::array<std::remove_cvref_t<decltype(Record{}.u[0])>, Width>;

template <std::size_t Width, class Record>
Numbers<Width, Record> numbers_of(const Record& v) {
  Numbers<Width, Record> numbers;
  std::copy_n(v.u, 3, numbers.data());
  if constexpr (Width == 6) std::copy_n(v.w, 3, numbers.data() + 3);
  return numbers;
}

template <std::size_t Width, class Record>
void assign(const Numbers<Width, Record>& numbers, Record& v) {
  std::copy_n(numbers.data(), 3, v.u);
  if constexpr (Width == 6) std::copy_n(numbers.data() + 3, 3, v.w);
}

/// Number `k` of those that begin at `from`. Read one by one: copied as an array, they would go over the
/// stack.
template <class Number>
Number number_at(const std::byte* from, std::size_t k) {
  Number number;
  std::memcpy(&number, from + k * sizeof number, sizeof number);
  return number;
}

/// The bodies in `slots`, to `out`, which has room for them.
template <std::size_t Width, class Record>
void write_velocities(std::span<const Record> velocity, std::span<const Slot> slots, std::byte* out) {
  for (const Slot slot : slots) {
    const Record& v = velocity[at(slot)];
    std::memcpy(out, v.u, sizeof v.u);
    if constexpr (Width == 6) std::memcpy(out + sizeof v.u, v.w, sizeof v.w);
    out += sizeof(Numbers<Width, Record>);
  }
}

/// Replaces each number of a pair's own copy by rule(own, the neighbour's).
template <std::size_t Width, class Record, class Rule>
void settle_pairs(std::span<Record> velocity, std::span<const Pair> pairs, const std::byte* message,
                  const Rule& rule) {
  using Number = typename Numbers<Width, Record>::value_type;
  for (const Pair& pair : pairs) {
    Record& v = velocity[at(pair.slot)];
    const std::byte* const other = message + pair.place.at() * sizeof(Numbers<Width, Record>);
    for (std::size_t k = 0; k < 3; ++k) v.u[k] = rule(v.u[k], number_at<Number>(other, k));
    if constexpr (Width == 6)
      for (std::size_t k = 0; k < 3; ++k) v.w[k] = rule(v.w[k], number_at<Number>(other, k + 3));
  }
}

/// Rules of settle_pairs.
inline constexpr auto mean = [](auto own, auto other) { return (own + other) / 2; };
inline constexpr auto taken_over = [](auto, auto other) { return other; };

}  // namespace talus::detail
