#pragma once

/// The narrow phase between grains on W = 4 or 8 pairs at a time (kernels/narrow_phase.hpp): rows of pairs
/// are added up, transposed once, and the rule that makes contacts of them is followed without branches. Per
/// pair: 2 rows of 64 bytes read, 40 bytes written, 4 divisions, a square root, about 40 flop.

#include "kernels/detail/contact_view.hpp"
#include "kernels/detail/lanes.hpp"

namespace talus {
namespace {

/// Two grains from their rows.
template <class V>
struct Pairing {
  Space<V> d;  ///< x_i - x_j
  V radius_i;
  Space<V> v;  ///< u_i - u_j
  V radius_j;
};

[[gnu::always_inline]] inline Pairing<Quad> meet(const double* const* a, const double* const* b, Quad) {
  Quad c[8];
#pragma GCC unroll 4
  for (int l = 0; l < 4; ++l) {
    c[l] = load<Quad>(a[l]) + load<Quad>(b[l]);
    c[4 + l] = load<Quad>(a[l] + 4) + load<Quad>(b[l] + 4);
  }
  swap_rows_and_columns(c[0], c[1], c[2], c[3]);
  swap_rows_and_columns(c[4], c[5], c[6], c[7]);
  return {{c[0], c[1], c[2]}, c[3], {c[4], c[5], c[6]}, c[7]};
}

[[gnu::always_inline]] inline Pairing<Octet> meet(const double* const* a, const double* const* b, Octet) {
  Octet c[8];
#pragma GCC unroll 8
  for (int l = 0; l < 8; ++l) c[l] = load<Octet>(a[l]) + load<Octet>(b[l]);
  transpose(c);
  return {{c[0], c[1], c[2]}, c[3], {c[4], c[5], c[6]}, c[7]};
}

template <class V>
using BitsOf = decltype(V{} < V{});

/// W pairs from `at` of `out` on; returns the lanes that came far.
template <class V>
[[gnu::always_inline]] inline BitsOf<V> gap_block(const double* const* a, const double* const* b,
                                                  const GapRule& rule, const GapTarget& out, std::size_t at) {
  const Pairing<V> pair = meet(a, b, V{});
  const V distance = root(dot(pair.d, pair.d));
  const BitsOf<V> apart = distance > 0;
  const Space<V> n = {apart ? pair.d.x / distance : V{}, apart ? pair.d.y / distance : V{},
                      apart ? pair.d.z / distance : V{} + 1.0};
  const V gap = distance - pair.radius_i - pair.radius_j, v_n = dot(n, pair.v);
  BitsOf<V> none = (gap >= rule.alert) & (gap >= -rule.time_step * v_n);
  V bias = (gap > 0 ? gap : rule.overlap_correction * gap) / rule.time_step;
  if (rule.restitution > 0) {
    const BitsOf<V> quick = absolute(v_n) > rule.slow;
    none |= quick & (gap > 0);
    bias = quick ? rule.restitution * v_n : bias;
  }
  store(out.nx + at, n.x);
  store(out.ny + at, n.y);
  store(out.nz + at, n.z);
  store(out.bias + at, bias);
  const BitsOf<V> contact = ~none;
  __builtin_memcpy(out.contact + at, &contact, sizeof(contact));
  const Space<V> way = (V{} + 0.5 * rule.time_step) * pair.v;
  const V small = pair.radius_j < pair.radius_i ? pair.radius_j : pair.radius_i;
  return ~(dot(way, way) < 0.25 * small * small);
}

template <int W>
bool find_gaps(const PairView& view, const GapRule& rule, const GapTarget& target) {
  using V = Lanes<W>;
  const PairView pairs = view;  // local ones, so that no store can change them
  const GapTarget out = target;
  BitsOf<V> far{};
  const auto rows = [&](std::size_t k, const double*& a, const double*& b) {
    const std::uint16_t* local =
        pairs.local + 2 * static_cast<std::size_t>(static_cast<std::uint32_t>(pairs.candidate[k]));
    a = pairs.first + 8 * static_cast<std::size_t>(local[0]);
    b = pairs.second + 8 * static_cast<std::size_t>(local[1]);
  };
  const double *a[W], *b[W];
  std::size_t k = 0;
  for (; k + W <= pairs.count; k += W) {
#pragma GCC unroll 8
    for (std::size_t l = 0; l < W; ++l) rows(k + l, a[l], b[l]);
    far |= gap_block<V>(a, b, rule, out, k);
  }
  if (const std::size_t rest = pairs.count - k; rest > 0) {  // the last pair fills the lanes behind it
    for (std::size_t l = 0; l < W; ++l) rows(k + (l < rest ? l : rest - 1), a[l], b[l]);
    double nx[W], ny[W], nz[W], bias[W];
    std::int64_t contact[W];
    far |= gap_block<V>(a, b, rule, {nx, ny, nz, bias, contact}, 0);
    for (std::size_t l = 0; l < rest; ++l) {
      out.nx[k + l] = nx[l];
      out.ny[k + l] = ny[l];
      out.nz[k + l] = nz[l];
      out.bias[k + l] = bias[l];
      out.contact[k + l] = contact[l];
    }
  }
  bool any = false;
  for (int l = 0; l < W; ++l) any |= far[l] != 0;
  return any;
}

}  // namespace
}  // namespace talus
