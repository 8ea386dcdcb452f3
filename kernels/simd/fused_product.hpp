#pragma once

/// a b + c rounded once, on vectors, for processors without an instruction for it: exact products and sums by
/// parts, and one rounding at the end (Boldo and Melquiond 2008, "Emulation of FMA and correctly rounded
/// sums: proved algorithms using rounding to odd"). The fma of the C library takes hundreds of nanoseconds
/// there, as it changes the rounding mode.
///
/// Internal linkage, as everything in lanes.hpp.

#include <cstddef>
// Calls are within one translation unit, so that it does not matter how they pass vectors.
#pragma GCC diagnostic ignored "-Wpsabi"

namespace talus {
namespace {

template <class V>
struct SumByParts {
  V high, low;  ///< the rounded sum, and what the rounding lost
};
/// Exact for any two numbers (Knuth).
template <class V>
[[gnu::always_inline]] inline SumByParts<V> exact_sum(V a, V b) {
  const V s = a + b, b_part = s - a, a_part = s - b_part;
  return {s, (a - a_part) + (b - b_part)};
}

/// Rounds high + low to odd: where something is lost, the last bit becomes 1, so that a second rounding to
/// fewer bits errs no more than one from the exact sum. `Unsigned` is a vector of as many 64-bit integers.
template <class Unsigned, class V>
[[gnu::always_inline]] inline V round_to_odd(SumByParts<V> sum) {
  const auto lost = reinterpret_cast<Unsigned>(sum.low != V{});
  const auto bits = reinterpret_cast<Unsigned>(sum.high), even = ~bits & 1;
  const Unsigned opposed = (bits ^ reinterpret_cast<Unsigned>(sum.low)) >> 63;
  return reinterpret_cast<V>(bits + (lost & (even - ((even & opposed) << 1))));
}

/// The halves of a double, 26 bits each (Veltkamp), and of a product its rounding and its error (Dekker).
template <class V>
[[gnu::always_inline]] inline SumByParts<V> exact_product(V a, V b) {
  const auto upper = [](V v) {
    const V scaled = 134217729.0 * v;  // 2^27 + 1
    return scaled - (scaled - v);
  };
  const V a_high = upper(a), a_low = a - a_high, b_high = upper(b), b_low = b - b_high, p = a * b;
  return {p, a_low * b_low - (((p - a_high * b_high) - a_low * b_high) - a_high * b_low)};
}

/// Of doubles. Where a part could leave their range the C library is asked. Called, not inlined: a sweep has
/// hundreds of fused products.
template <class Unsigned, class V>
[[gnu::noinline]] V fused_doubles(V a, V b, V c) {
  const SumByParts<V> product = exact_product(a, b), t = exact_sum(c, product.low),
                      v = exact_sum(product.high, t.high);
  V sum = v.high + round_to_odd<Unsigned>(exact_sum(t.low, v.low));
  sum = sum == V{} ? product.high + c : sum;  // an exact 0 has the sign of the plain sum
  constexpr double large = 0x1p500, small = 0x1p-900;
  const auto within = [](V x) { return (x < large) & (x > -large); };
  const auto safe = within(a) & within(b) & within(c) &
                    ((product.high > small) | (product.high < -small) | (a == V{}) | (b == V{}));
  for (std::size_t l = 0; l < sizeof(V) / sizeof(double); ++l)
    if (!safe[l]) sum[l] = __builtin_fma(a[l], b[l], c[l]);
  return sum;
}

/// Of floats, as doubles `Wide`, whose products are exact.
template <class Unsigned, class Wide, class V>
[[gnu::noinline]] V fused_floats(V a, V b, V c) {
  const SumByParts<Wide> sum = exact_sum(__builtin_convertvector(a, Wide) * __builtin_convertvector(b, Wide),
                                         __builtin_convertvector(c, Wide));
  const Wide odd = round_to_odd<Unsigned>(sum);
  // What is no number, or infinite, has no parts.
  return __builtin_convertvector(sum.low == sum.low ? odd : sum.high, V);
}

}  // namespace
}  // namespace talus
