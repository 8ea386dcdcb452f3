#pragma once

/// Vectors of 4 or 8 doubles, or of 8 floats, and what the sweeps need of them, on the compiler's vector
/// extension (g++ and clang++), so that one text serves every instruction set; only masks, the square root,
/// fused products and the maximum name intrinsics.
///
/// Everything here has internal linkage and includes nothing that has not: each user is compiled for its own
/// instruction set, and a function shared between them would be kept by the linker in one version, that may
/// be one that the processor does not know.
///
/// Nothing is fused that does not say so (-ffp-contract=off), and `fused` rounds once on every processor: a
/// lane computes the same bits on all of them (docs/decisions/0008-lanes.md).

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "kernels/simd/fused_product.hpp"
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
typedef unsigned long long QuadOfBits __attribute__((vector_size(32)));
typedef unsigned long long OctetOfBits __attribute__((vector_size(64)));
typedef float NarrowQuad __attribute__((vector_size(16)));
typedef float NarrowOctet __attribute__((vector_size(32)));
template <class V>
struct ElementOf {
  using Type = std::remove_cvref_t<decltype(V{}[0])>;
};
template <std::floating_point V>
struct ElementOf<V> {
  using Type = V;
};
/// An element of V; a number is a vector of one lane.
template <class V>
using NumberOf = typename ElementOf<V>::Type;

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

#ifndef __AVX2__
template <class V, class Number>
[[gnu::always_inline]] inline V load(const Number* from, std::size_t at, FirstLanes lanes) {
  V v{};
  for (std::size_t l = 0; l < sizeof(V) / sizeof(NumberOf<V>) && at + l < lanes.count; ++l)
    v[l] = from[at + l];
  return v;
}
template <class V, class Number>
[[gnu::always_inline]] inline void store(Number* to, std::size_t at, V v, FirstLanes lanes) {
  for (std::size_t l = 0; l < sizeof(V) / sizeof(NumberOf<V>) && at + l < lanes.count; ++l)
    to[at + l] = static_cast<Number>(v[l]);
}
#else
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

[[gnu::always_inline]] inline double root(double v) {
  return __builtin_sqrt(v);
}

/// a b + c, rounded once.
template <std::floating_point Number>
[[gnu::always_inline]] inline Number fused(Number a, Number b, Number c) {
  if constexpr (std::same_as<Number, float>)
    return __builtin_fmaf(a, b, c);
  else
    return __builtin_fma(a, b, c);
}
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
#ifdef __FP_FAST_FMA
  V sum{};
  for (std::size_t l = 0; l < sizeof(V) / sizeof(NumberOf<V>); ++l) sum[l] = fused(a[l], b[l], c[l]);
  return sum;
#else
  if constexpr (std::same_as<V, Quad>)
    return fused_doubles<QuadOfBits>(a, b, c);
  else
    return fused_floats<OctetOfBits, Octet>(a, b, c);
#endif
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

[[gnu::always_inline]] inline double absolute(double v) {
  return __builtin_fabs(v);
}
template <class V>
[[gnu::always_inline]] inline V absolute(V v) {
  using Bits = decltype(v < v);
  return reinterpret_cast<V>(reinterpret_cast<Bits>(v) & ~reinterpret_cast<Bits>(-V{}));
}

/// Whether a comparison holds in one lane at least.
[[gnu::always_inline]] inline bool any_of(bool holds) {
  return holds;
}
template <class Bits>
[[gnu::always_inline]] inline bool any_of(Bits holds) {
#ifdef __AVX512F__
  if constexpr (sizeof(Bits) == 64)
    return _mm512_test_epi64_mask(reinterpret_cast<__m512i>(holds), reinterpret_cast<__m512i>(holds)) != 0;
#endif
#ifdef __AVX__
  if constexpr (sizeof(Bits) == 32)
    return _mm256_testz_si256(reinterpret_cast<__m256i>(holds), reinterpret_cast<__m256i>(holds)) == 0;
#endif
  bool any = false;
  for (std::size_t l = 0; l < sizeof(Bits) / sizeof(holds[0]); ++l) any |= holds[l] != 0;
  return any;
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
template <class V>
[[gnu::always_inline]] inline Space<V> cross(const Space<V>& a, const Space<V>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
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

}  // namespace
}  // namespace talus
