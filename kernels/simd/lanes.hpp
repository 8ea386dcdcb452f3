#pragma once

/// Vectors of 4 or 8 doubles, or of 8 floats, and what the sweeps need of them, on the compiler's vector
/// extension (g++ and clang++), so that one text serves every instruction set; only masks, the square root,
/// fused products and the maximum name intrinsics.
///
/// Everything here has internal linkage and includes nothing that has not: each user is compiled for its own
/// instruction set, and a function shared between them would be kept by the linker in one version, that may
/// be one that the processor does not know.
///
/// Nothing is fused that does not say so (-ffp-contract=off): a lane computes to the bit what the scalar
/// kernel with the same rounding computes for the same contact (docs/decisions/0008-lanes.md).

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <type_traits>
// Vectors pass between inlined functions only, so that it does not matter how a call would pass them.
#pragma GCC diagnostic ignored "-Wpsabi"
#ifdef __AVX__
#include <immintrin.h>
#endif

namespace talus {
namespace {

/// Half a body record.
typedef double Quad __attribute__((vector_size(32)));
typedef double Octet __attribute__((vector_size(64)));
typedef float NarrowQuad __attribute__((vector_size(16)));
typedef float NarrowOctet __attribute__((vector_size(32)));
/// An element of V.
template <class V>
using NumberOf = std::remove_cvref_t<decltype(V{}[0])>;

template <int W>
struct LanesOf;
template <>
struct LanesOf<4> {
  using Type = Quad;
};
template <>
struct LanesOf<8> {
  using Type = Octet;
};
/// W doubles.
template <int W>
using Lanes = typename LanesOf<W>::Type;

template <class V>
[[gnu::always_inline]] inline V load(const double* from) {
  V v;
  __builtin_memcpy(&v, from, sizeof(V));
  return v;
}
template <class V>
[[gnu::always_inline]] inline void store(double* to, V v) {
  __builtin_memcpy(to, &v, sizeof(V));
}

/// Floats, widened when they are read and rounded when they are written.
template <class V>
struct NarrowOf {
  using Type = NarrowQuad;
};
template <>
struct NarrowOf<Octet> {
  using Type = NarrowOctet;
};
template <class V>
[[gnu::always_inline]] inline V load(const float* from) {
  if constexpr (std::same_as<V, NarrowOctet>) {
    V v;
    __builtin_memcpy(&v, from, sizeof(v));
    return v;
  } else {
    typename NarrowOf<V>::Type v;
    __builtin_memcpy(&v, from, sizeof(v));
    return __builtin_convertvector(v, V);
  }
}
[[gnu::always_inline]] inline void store(float* to, NarrowOctet v) {
  __builtin_memcpy(to, &v, sizeof(v));
}
template <class V>
[[gnu::always_inline]] inline void store(float* to, V v) {
  const auto narrow = __builtin_convertvector(v, typename NarrowOf<V>::Type);
  __builtin_memcpy(to, &narrow, sizeof(narrow));
}

/// Two half records beside each other.
[[gnu::always_inline]] inline NarrowOctet load_halves(const float* left, const float* right) {
  NarrowQuad l, r;
  __builtin_memcpy(&l, left, sizeof(l));
  __builtin_memcpy(&r, right, sizeof(r));
  return __builtin_shufflevector(l, r, 0, 1, 2, 3, 4, 5, 6, 7);
}
[[gnu::always_inline]] inline void store_halves(float* left, float* right, NarrowOctet v) {
  const NarrowQuad l = __builtin_shufflevector(v, v, 0, 1, 2, 3),
                   r = __builtin_shufflevector(v, v, 4, 5, 6, 7);
  __builtin_memcpy(left, &l, sizeof(l));
  __builtin_memcpy(right, &r, sizeof(r));
}

/// Which lanes a load or store means: all of them ...
struct AllLanes {};
/// ... or those of the first `count` elements of an array: behind them zeros are read and nothing is written.
struct FirstLanes {
  std::size_t count;
};

template <class V>
[[gnu::always_inline]] inline V load(const double* from, std::size_t at, AllLanes) {
  return load<V>(from + at);
}
template <class V>
[[gnu::always_inline]] inline V load(const float* from, std::size_t at, AllLanes) {
  return load<V>(from + at);
}
template <class Number, class V>
[[gnu::always_inline]] inline void store(Number* to, std::size_t at, V v, AllLanes) {
  store(to + at, v);
}

#ifdef __AVX2__
/// All bits of the lanes at, at + 1, ... that are meant.
[[gnu::always_inline]] inline __m256i mask_of(std::size_t at, FirstLanes lanes) {
  const auto left = static_cast<long long>(lanes.count) - static_cast<long long>(at);
  return _mm256_cmpgt_epi64(_mm256_set1_epi64x(left), _mm256_setr_epi64x(0, 1, 2, 3));
}
[[gnu::always_inline]] inline __m128i narrow_mask_of(std::size_t at, FirstLanes lanes) {
  const auto left = static_cast<int>(lanes.count) - static_cast<int>(at);
  return _mm_cmpgt_epi32(_mm_set1_epi32(left), _mm_setr_epi32(0, 1, 2, 3));
}
template <std::same_as<Quad> V>
[[gnu::always_inline]] inline V load(const double* from, std::size_t at, FirstLanes lanes) {
  return reinterpret_cast<V>(_mm256_maskload_pd(from + at, mask_of(at, lanes)));
}
template <std::same_as<Quad> V>
[[gnu::always_inline]] inline V load(const float* from, std::size_t at, FirstLanes lanes) {
  return reinterpret_cast<V>(_mm256_cvtps_pd(_mm_maskload_ps(from + at, narrow_mask_of(at, lanes))));
}
[[gnu::always_inline]] inline void store(double* to, std::size_t at, Quad v, FirstLanes lanes) {
  _mm256_maskstore_pd(to + at, mask_of(at, lanes), reinterpret_cast<__m256d>(v));
}
[[gnu::always_inline]] inline void store(float* to, std::size_t at, Quad v, FirstLanes lanes) {
  _mm_maskstore_ps(to + at, narrow_mask_of(at, lanes), _mm256_cvtpd_ps(reinterpret_cast<__m256d>(v)));
}
#endif
#if defined(__AVX2__) && !defined(__AVX512VL__)
[[gnu::always_inline]] inline __m256i single_mask_of(std::size_t at, FirstLanes lanes) {
  const auto left = static_cast<int>(lanes.count) - static_cast<int>(at);
  return _mm256_cmpgt_epi32(_mm256_set1_epi32(left), _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7));
}
template <std::same_as<NarrowOctet> V>
[[gnu::always_inline]] inline V load(const float* from, std::size_t at, FirstLanes lanes) {
  return reinterpret_cast<V>(_mm256_maskload_ps(from + at, single_mask_of(at, lanes)));
}
[[gnu::always_inline]] inline void store(float* to, std::size_t at, NarrowOctet v, FirstLanes lanes) {
  _mm256_maskstore_ps(to + at, single_mask_of(at, lanes), reinterpret_cast<__m256>(v));
}
#endif
#ifdef __AVX512VL__
[[gnu::always_inline]] inline __mmask8 bits_of(std::size_t at, FirstLanes lanes) {
  const std::size_t left = lanes.count - at;
  return static_cast<__mmask8>(left >= 8 ? 0xffU : (1U << left) - 1U);
}
template <std::same_as<Octet> V>
[[gnu::always_inline]] inline V load(const double* from, std::size_t at, FirstLanes lanes) {
  return reinterpret_cast<V>(_mm512_maskz_loadu_pd(bits_of(at, lanes), from + at));
}
template <std::same_as<Octet> V>
[[gnu::always_inline]] inline V load(const float* from, std::size_t at, FirstLanes lanes) {
  return reinterpret_cast<V>(
      _mm512_maskz_cvtps_pd(0xff, _mm256_maskz_loadu_ps(bits_of(at, lanes), from + at)));
}
template <std::same_as<NarrowOctet> V>
[[gnu::always_inline]] inline V load(const float* from, std::size_t at, FirstLanes lanes) {
  return reinterpret_cast<V>(_mm256_maskz_loadu_ps(bits_of(at, lanes), from + at));
}
[[gnu::always_inline]] inline void store(float* to, std::size_t at, NarrowOctet v, FirstLanes lanes) {
  _mm256_mask_storeu_ps(to + at, bits_of(at, lanes), reinterpret_cast<__m256>(v));
}
[[gnu::always_inline]] inline void store(double* to, std::size_t at, Octet v, FirstLanes lanes) {
  _mm512_mask_storeu_pd(to + at, bits_of(at, lanes), reinterpret_cast<__m512d>(v));
}
[[gnu::always_inline]] inline void store(float* to, std::size_t at, Octet v, FirstLanes lanes) {
  _mm256_mask_storeu_ps(to + at, bits_of(at, lanes),
                        _mm512_maskz_cvtpd_ps(0xff, reinterpret_cast<__m512d>(v)));
}
#endif

[[gnu::always_inline]] inline Quad root(Quad v) {
#ifdef __AVX__
  return reinterpret_cast<Quad>(_mm256_sqrt_pd(reinterpret_cast<__m256d>(v)));
#else
  for (int k = 0; k < 4; ++k) v[k] = __builtin_sqrt(v[k]);
  return v;
#endif
}
[[gnu::always_inline]] inline Octet root(Octet v) {
#ifdef __AVX512F__
  return reinterpret_cast<Octet>(_mm512_maskz_sqrt_pd(0xff, reinterpret_cast<__m512d>(v)));
#else
  for (int k = 0; k < 8; ++k) v[k] = __builtin_sqrt(v[k]);
  return v;
#endif
}

[[gnu::always_inline]] inline NarrowOctet root(NarrowOctet v) {
#ifdef __AVX__
  return reinterpret_cast<NarrowOctet>(_mm256_sqrt_ps(reinterpret_cast<__m256>(v)));
#else
  for (int k = 0; k < 8; ++k) v[k] = __builtin_sqrtf(v[k]);
  return v;
#endif
}

/// a b + c, rounded once.
template <class V>
[[gnu::always_inline]] inline V fused(V a, V b, V c) {
#ifdef __FMA__
  if constexpr (std::same_as<V, Quad>)
    return reinterpret_cast<V>(_mm256_fmadd_pd(reinterpret_cast<__m256d>(a), reinterpret_cast<__m256d>(b),
                                               reinterpret_cast<__m256d>(c)));
  if constexpr (std::same_as<V, NarrowOctet>)
    return reinterpret_cast<V>(_mm256_fmadd_ps(reinterpret_cast<__m256>(a), reinterpret_cast<__m256>(b),
                                               reinterpret_cast<__m256>(c)));
#endif
#ifdef __AVX512F__
  if constexpr (std::same_as<V, Octet>)
    return reinterpret_cast<V>(_mm512_fmadd_pd(reinterpret_cast<__m512d>(a), reinterpret_cast<__m512d>(b),
                                               reinterpret_cast<__m512d>(c)));
#endif
  V sum{};
  for (std::size_t l = 0; l < sizeof(V) / sizeof(NumberOf<V>); ++l)
    if constexpr (std::same_as<NumberOf<V>, float>)
      sum[l] = __builtin_fmaf(a[l], b[l], c[l]);
    else
      sum[l] = __builtin_fma(a[l], b[l], c[l]);
  return sum;
}

/// The larger of 0 and v; a NaN stays one.
template <class V>
[[gnu::always_inline]] inline V positive_part(V v) {
#ifdef __AVX__
  if constexpr (std::same_as<V, Quad>)
    return reinterpret_cast<V>(_mm256_max_pd(_mm256_setzero_pd(), reinterpret_cast<__m256d>(v)));
  if constexpr (std::same_as<V, NarrowOctet>)
    return reinterpret_cast<V>(_mm256_max_ps(_mm256_setzero_ps(), reinterpret_cast<__m256>(v)));
#endif
#ifdef __AVX512F__
  if constexpr (std::same_as<V, Octet>)
    return reinterpret_cast<V>(_mm512_maskz_max_pd(0xff, _mm512_setzero_pd(), reinterpret_cast<__m512d>(v)));
#endif
  return V{} > v ? V{} : v;
}

template <class V>
[[gnu::always_inline]] inline V absolute(V v) {
  using Bits = decltype(v < v);
  return reinterpret_cast<V>(reinterpret_cast<Bits>(v) & ~reinterpret_cast<Bits>(-V{}));
}

/// x, y, z of W vectors in space.
template <class V>
struct Space {
  V x, y, z;
};
template <class V>
[[gnu::always_inline]] inline Space<V> operator+(const Space<V>& a, const Space<V>& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class V>
[[gnu::always_inline]] inline Space<V> operator-(const Space<V>& a, const Space<V>& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class V>
[[gnu::always_inline]] inline Space<V> operator*(V s, const Space<V>& a) {
  return {s * a.x, s * a.y, s * a.z};
}
template <class V>
[[gnu::always_inline]] inline V dot(const Space<V>& a, const Space<V>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
/// s a + b, and products of which all but the first is fused.
template <class V>
[[gnu::always_inline]] inline Space<V> add_scaled(V s, const Space<V>& a, const Space<V>& b) {
  return {fused(s, a.x, b.x), fused(s, a.y, b.y), fused(s, a.z, b.z)};
}
template <class V>
[[gnu::always_inline]] inline V fused_dot(const Space<V>& a, const Space<V>& b) {
  return fused(a.z, b.z, fused(a.y, b.y, a.x * b.x));
}
template <class V>
[[gnu::always_inline]] inline Space<V> fused_cross(const Space<V>& a, const Space<V>& b) {
  return {fused(a.y, b.z, -(a.z * b.y)), fused(a.z, b.x, -(a.x * b.z)), fused(a.x, b.y, -(a.y * b.x))};
}
/// v - w x n.
template <class V>
[[gnu::always_inline]] inline Space<V> less_cross(const Space<V>& v, const Space<V>& w, const Space<V>& n) {
  return {fused(w.z, n.y, fused(-w.y, n.z, v.x)), fused(w.x, n.z, fused(-w.z, n.x, v.y)),
          fused(w.y, n.x, fused(-w.x, n.y, v.z))};
}

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
