#pragma once

/// The narrow phase between grains on W = 4 or 8 pairs at a time (kernels/detection/narrow_phase.hpp):
/// differences of pairs are transposed once, and the rule that makes contacts of them is followed without
/// branches, but for lanes none of which turns on its way (pair_path.hpp). Per pair: 2 centres, velocities
/// and radii of 56 bytes read, 40 bytes written, 4 divisions, a square root, about 50 flop.

#include "kernels/detection/detail/gap_kernels.hpp"
#include "kernels/detection/detail/pair_path.hpp"
#include "kernels/law/gap_law.hpp"
#include "kernels/simd/lanes.hpp"
#include "kernels/simd/transpose.hpp"

namespace talus {
namespace {

/// W pairs as lanes.
template <class V>
struct Pairing {
  Space<V> d;  ///< x_i - x_j
  Space<V> v;  ///< u_i - u_j
  V radius_i, radius_j;
};

/// x_i - x_j in the first three lanes; nothing beyond the three numbers of a centre is read.
template <std::same_as<Quad> V>
[[gnu::always_inline]] inline V apart(const PairView& pairs, std::size_t i, std::size_t j) {
  return load<V>(pairs.x + 3 * i, 0, FirstLanes{3}) - load<V>(pairs.x + 3 * j, 0, FirstLanes{3});
}
[[gnu::always_inline]] inline Quad relative(const PairView& pairs, std::size_t i, std::size_t j) {
  return load<Quad>(pairs.velocity + record_numbers * i) - load<Quad>(pairs.velocity + record_numbers * j);
}

template <std::same_as<Quad> V>
[[gnu::always_inline]] inline Pairing<V> meet(const PairView& pairs, const std::size_t* i,
                                              const std::size_t* j, V) {
  Quad d[4], v[4];
#pragma GCC unroll 4
  for (int l = 0; l < 4; ++l) {
    d[l] = apart<V>(pairs, i[l], j[l]);
    v[l] = relative(pairs, i[l], j[l]);
  }
  swap_rows_and_columns(d[0], d[1], d[2], d[3]);
  swap_rows_and_columns(v[0], v[1], v[2], v[3]);
  const double* r = pairs.radius;
  const Quad radius_i = {r[i[0]], r[i[1]], r[i[2]], r[i[3]]}, radius_j = {r[j[0]], r[j[1]], r[j[2]], r[j[3]]};
  return {{d[0], d[1], d[2]}, {v[0], v[1], v[2]}, radius_i, radius_j};
}

template <std::same_as<Octet> V>
[[gnu::always_inline]] inline Pairing<V> meet(const PairView& pairs, const std::size_t* i,
                                              const std::size_t* j, V) {
  using Half = std::conditional_t<std::same_as<V, Octet>, Quad, V>;  // of V, as masks are known later
  Octet c[8];
#pragma GCC unroll 8
  for (int l = 0; l < 8; ++l)
    c[l] = __builtin_shufflevector(apart<Half>(pairs, i[l], j[l]), relative(pairs, i[l], j[l]), 0, 1, 2, 3, 4,
                                   5, 6, 7);
  transpose(c);
  const double* r = pairs.radius;
  const Octet radius_i = {r[i[0]], r[i[1]], r[i[2]], r[i[3]], r[i[4]], r[i[5]], r[i[6]], r[i[7]]},
              radius_j = {r[j[0]], r[j[1]], r[j[2]], r[j[3]], r[j[4]], r[j[5]], r[j[6]], r[j[7]]};
  return {{c[0], c[1], c[2]}, {c[4], c[5], c[6]}, radius_i, radius_j};
}

/// Restitution, and how far cohesion reaches over the smaller radius; E is a number, or one per lane.
template <class E>
struct GapLaw {
  E restitution, reach;
};

/// That of all pairs, or of each its own.
struct OneLaw {
  GapLaw<double> value;
  template <class V, class Only>
  [[gnu::always_inline]] GapLaw<double> of(std::size_t, Only) const {
    return value;
  }
};
struct OwnLaws {
  const double *restitution, *reach;
  template <class V, class Only>
  [[gnu::always_inline]] GapLaw<V> of(std::size_t k, Only only) const {
    return {load<V>(restitution + k, 0, only), load<V>(reach + k, 0, only)};
  }
};

/// The bodies of the pairs in the lanes.
struct LaneSlots {
  const std::size_t *i, *j;
};

/// In which space contacts are looked for, and by which rule.
template <class S>
struct GapSearch {
  S space;
  GapRule rule;  ///< a copy, so that no store of a contact can change it
};

/// Writes W pairs from place `at` of `out` on; returns the lanes whose bodies came far (came_far in
/// passing.hpp).
template <class V, class S, class E>
[[gnu::always_inline]] inline BitsOf<V> gap_block(const PairView& pairs, const GapSearch<S>& search,
                                                  LaneSlots slots, const GapLaw<E>& law, const GapTarget& out,
                                                  std::size_t at) {
  const GapRule& rule = search.rule;
  Pairing<V> pair = meet(pairs, slots.i, slots.j, V{});
  search.space.meet(pair.d.x, pair.d.y, pair.d.z, pair.v.x, pair.v.y, pair.v.z);
  const V distance = root(dot(pair.d, pair.d));
  const BitsOf<V> off = distance > 0;
  const Space<V> n = {off ? pair.d.x / distance : V{}, off ? pair.d.y / distance : V{},
                      off ? pair.d.z / distance : V{} + 1.0};
  const Space<V> way = (V{} + rule.time_step) * pair.v;
  V gap = distance - pair.radius_i - pair.radius_j;
  const V v_n = dot(n, pair.v);
  const V small = pair.radius_j < pair.radius_i ? pair.radius_j : pair.radius_i;
  if (const BitsOf<V> turns = turns_on_path(n, gap, law.reach * small, way, distance); any_of(turns))
    gap = turns ? gap_on_path(n, gap, pair.d, way, pair.radius_i + pair.radius_j) : gap;
  // Gravity moves both alike.
  const GapResult<V> found = solve_gap(rule, gap, v_n, v_n, law.restitution, law.reach * small);
  store(out.nx + at, n.x);
  store(out.ny + at, n.y);
  store(out.nz + at, n.z);
  store(out.bias + at, found.bias);
  const BitsOf<V> contact = ~found.absent;
  __builtin_memcpy(out.contact + at, &contact, sizeof(contact));
  return ~(dot(way, way) < 0.25 * small * small);
}

template <int W, class S, class E>
[[gnu::always_inline]] inline bool find_gaps_with(const PairView& view, const GapSearch<S>& search,
                                                  const E& laws, const GapTarget& target) {
  using V = Lanes<W>;
  const PairView pairs = view;  // local ones, so that no store can change them
  const GapTarget out = target;
  BitsOf<V> far{};
  constexpr std::size_t ahead = 24;  // prefetch distance in pairs: sweeps do not cache these data
  std::size_t i[W], j[W];
  const auto slots = [&](std::size_t k, std::size_t lane) {
    i[lane] = std::size_t{pairs.first[k] / record_numbers};
    j[lane] = std::size_t{pairs.second[k] / record_numbers};
  };
  // Inlined by order: g++ 12 takes a function that only prefetches for one without effects, and drops its
  // calls.
  const auto ask = [&](std::uint32_t place) __attribute__((always_inline)) {
    __builtin_prefetch(pairs.x + 3 * std::size_t{place / record_numbers});
    __builtin_prefetch(pairs.velocity + place);
  };
  std::size_t k = 0;
  for (; k + W <= pairs.count; k += W) {
#pragma GCC unroll 8
    for (std::size_t l = 0; l < W; ++l) {
      slots(k + l, l);
      const std::size_t next = k + l + ahead;
      if (next < pairs.count) {
        ask(pairs.first[next]);
        ask(pairs.second[next]);
      }
    }
    far |= gap_block<V>(pairs, search, {i, j}, laws.template of<V>(k, AllLanes{}), out, k);
  }
  if (const std::size_t rest = pairs.count - k; rest > 0) {  // the last pair fills the lanes behind it
    for (std::size_t l = 0; l < W; ++l) slots(k + (l < rest ? l : rest - 1), l);
    double nx[W], ny[W], nz[W], bias[W];
    std::int64_t contact[W];
    far |= gap_block<V>(pairs, search, {i, j}, laws.template of<V>(k, FirstLanes{rest}),
                        {nx, ny, nz, bias, contact}, 0);
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

template <int W>
bool find_gaps(const PairView& view, const GapRule& rule, const GapTarget& target) {
  const auto with = [&](const auto& laws) {
    if (view.rates)
      return find_gaps_with<W>(view, GapSearch<FlowingSpace>{{*view.cell, *view.rates}, rule}, laws, target);
    if (view.cell) return find_gaps_with<W>(view, GapSearch<PeriodicSpace>{*view.cell, rule}, laws, target);
    return find_gaps_with<W>(view, GapSearch<WalledSpace>{{}, rule}, laws, target);
  };
  return view.restitution ? with(OwnLaws{view.restitution, view.reach})
                          : with(OneLaw{{rule.restitution, rule.reach}});
}

}  // namespace
}  // namespace talus
