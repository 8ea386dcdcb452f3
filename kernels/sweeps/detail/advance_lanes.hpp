#pragma once

/// Momentum of bodies, 4 or 8 numbers at a time (kernels/sweeps/momentum.hpp): a value s becomes
/// s + beta (s - last), and `last` becomes s.

#include "kernels/bodies/record.hpp"
#include "kernels/simd/lanes.hpp"

namespace talus {
namespace {

template <class V, class Number>
[[gnu::always_inline]] inline void advance_one(Number* value, Number* last, Number beta) {
  const V s = load<V>(value);
  store(value, s + beta * (s - load<V>(last)));
  store(last, s);
}

/// Advances whole records: masses, equal in both, keep their bits.
template <class V, class Number>
void advance_bodies(Number* bodies, Number* last, const std::int32_t* slots, std::size_t count, double beta) {
  constexpr std::size_t record = record_numbers, ahead = 8;
  for (std::size_t k = 0; k < count; ++k) {
    if (k + ahead < count) {
      __builtin_prefetch(bodies + record * static_cast<std::uint32_t>(slots[k + ahead]), 1);
      __builtin_prefetch(last + record * static_cast<std::uint32_t>(slots[k + ahead]), 1);
    }
    const std::size_t at = record * static_cast<std::uint32_t>(slots[k]);
#pragma GCC unroll 2
    for (std::size_t part = 0; part < record; part += sizeof(V) / sizeof(Number))
      advance_one<V>(bodies + at + part, last + at + part, static_cast<Number>(beta));
  }
}

}  // namespace
}  // namespace talus
