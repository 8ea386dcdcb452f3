#pragma once

/// Rows of body records become lanes and back, by shuffles; and two operations on whole records. Internal
/// linkage, as everything in lanes.hpp.

#include "kernels/simd/lanes.hpp"

namespace talus {
namespace {

/// 4 x 4: swaps rows and columns: c0 becomes the first elements of the rows, and so on.
[[gnu::always_inline]] inline void swap_rows_and_columns(Quad& c0, Quad& c1, Quad& c2, Quad& c3) {
  const Quad a = __builtin_shufflevector(c0, c1, 0, 4, 2, 6), b = __builtin_shufflevector(c0, c1, 1, 5, 3, 7);
  const Quad c = __builtin_shufflevector(c2, c3, 0, 4, 2, 6), d = __builtin_shufflevector(c2, c3, 1, 5, 3, 7);
  c0 = __builtin_shufflevector(a, c, 0, 1, 4, 5);
  c1 = __builtin_shufflevector(b, d, 0, 1, 4, 5);
  c2 = __builtin_shufflevector(a, c, 2, 3, 6, 7);
  c3 = __builtin_shufflevector(b, d, 2, 3, 6, 7);
}
/// The same on the left and on the right half at once.
[[gnu::always_inline]] inline void swap_rows_and_columns(NarrowOctet& c0, NarrowOctet& c1, NarrowOctet& c2,
                                                         NarrowOctet& c3) {
  const NarrowOctet a = __builtin_shufflevector(c0, c1, 0, 8, 1, 9, 4, 12, 5, 13),
                    b = __builtin_shufflevector(c0, c1, 2, 10, 3, 11, 6, 14, 7, 15),
                    c = __builtin_shufflevector(c2, c3, 0, 8, 1, 9, 4, 12, 5, 13),
                    d = __builtin_shufflevector(c2, c3, 2, 10, 3, 11, 6, 14, 7, 15);
  c0 = __builtin_shufflevector(a, c, 0, 1, 8, 9, 4, 5, 12, 13);
  c1 = __builtin_shufflevector(a, c, 2, 3, 10, 11, 6, 7, 14, 15);
  c2 = __builtin_shufflevector(b, d, 0, 1, 8, 9, 4, 5, 12, 13);
  c3 = __builtin_shufflevector(b, d, 2, 3, 10, 11, 6, 7, 14, 15);
}
/// 8 x 8: rows become columns, in 24 shuffles.
[[gnu::always_inline]] inline void transpose(Octet (&v)[8]) {
  Octet pair[8], four[8];
#pragma GCC unroll 4
  for (int k = 0; k < 8; k += 2) {
    pair[k] = __builtin_shufflevector(v[k], v[k + 1], 0, 8, 2, 10, 4, 12, 6, 14);
    pair[k + 1] = __builtin_shufflevector(v[k], v[k + 1], 1, 9, 3, 11, 5, 13, 7, 15);
  }
#pragma GCC unroll 2
  for (int k = 0; k < 8; k += 4)
#pragma GCC unroll 2
    for (int odd = 0; odd < 2; ++odd) {
      four[k + odd] = __builtin_shufflevector(pair[k + odd], pair[k + 2 + odd], 0, 1, 4, 5, 8, 9, 12, 13);
      four[k + 2 + odd] =
          __builtin_shufflevector(pair[k + odd], pair[k + 2 + odd], 2, 3, 6, 7, 10, 11, 14, 15);
    }
#pragma GCC unroll 4
  for (int k = 0; k < 4; ++k) {
    v[k] = __builtin_shufflevector(four[k], four[k + 4], 0, 1, 4, 5, 8, 9, 12, 13);
    v[k + 4] = __builtin_shufflevector(four[k], four[k + 4], 2, 3, 6, 7, 10, 11, 14, 15);
  }
}

/// The same with floats, whose shuffles stay within 128 bits as long as they can.
[[gnu::always_inline]] inline void transpose(NarrowOctet (&v)[8]) {
  NarrowOctet pair[8], four[8];
#pragma GCC unroll 4
  for (int k = 0; k < 8; k += 2) {
    pair[k] = __builtin_shufflevector(v[k], v[k + 1], 0, 8, 1, 9, 4, 12, 5, 13);
    pair[k + 1] = __builtin_shufflevector(v[k], v[k + 1], 2, 10, 3, 11, 6, 14, 7, 15);
  }
#pragma GCC unroll 2
  for (int k = 0; k < 8; k += 4)
#pragma GCC unroll 2
    for (int half = 0; half < 2; ++half) {
      const NarrowOctet a = pair[k + half], b = pair[k + 2 + half];
      four[k + 2 * half] = __builtin_shufflevector(a, b, 0, 1, 8, 9, 4, 5, 12, 13);
      four[k + 2 * half + 1] = __builtin_shufflevector(a, b, 2, 3, 10, 11, 6, 7, 14, 15);
    }
#pragma GCC unroll 4
  for (int k = 0; k < 4; ++k) {
    v[k] = __builtin_shufflevector(four[k], four[k + 4], 0, 1, 2, 3, 8, 9, 10, 11);
    v[k + 4] = __builtin_shufflevector(four[k], four[k + 4], 4, 5, 6, 7, 12, 13, 14, 15);
  }
}

/// The last element of each half record in all its places.
[[gnu::always_inline]] inline Quad spread_last(Quad v) {
  return __builtin_shufflevector(v, v, 3, 3, 3, 3);
}
[[gnu::always_inline]] inline Octet spread_last(Octet v) {
  return __builtin_shufflevector(v, v, 3, 3, 3, 3, 7, 7, 7, 7);
}

[[gnu::always_inline]] inline NarrowOctet spread_last(NarrowOctet v) {
  return __builtin_shufflevector(v, v, 3, 3, 3, 3, 7, 7, 7, 7);
}

/// Flips the sign of every element whose pattern is -0.0.
template <class V>
[[gnu::always_inline]] inline V flip(V v, V pattern) {
  using Bits = decltype(v < v);
  return reinterpret_cast<V>(reinterpret_cast<Bits>(v) ^ reinterpret_cast<Bits>(pattern));
}

}  // namespace
}  // namespace talus
