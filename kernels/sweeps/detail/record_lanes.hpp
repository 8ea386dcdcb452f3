#pragma once

/// The records of the bodies of contacts, and how they become lanes and back: the phases gather and scatter
/// of kernels/sweeps/detail/sweep_lanes.hpp. A record is {u, 1/m | w, R^2/I}: one half for the velocity and
/// its mobility, the other for the spin and its mobility.

#include "kernels/bodies/record.hpp"
#include "kernels/simd/contact_view.hpp"
#include "kernels/simd/lanes.hpp"
#include "kernels/simd/transpose.hpp"

namespace talus {
namespace {

/// Number of lanes of V.
template <class V>
constexpr int width_of = sizeof(V) / sizeof(NumberOf<V>);

/// The records of the first (or second) bodies of contacts from some place on.
template <class Number>
struct Records {
  Number* bodies;
  const std::uint32_t* begin;  ///< in numbers, as in ContactViewOf
  [[gnu::always_inline]] Number* operator[](std::size_t l) const { return bodies + begin[l]; }
  [[gnu::always_inline]] Records operator+(std::size_t l) const { return {bodies, begin + l}; }
};

template <class View, class Number>
[[gnu::always_inline]] inline Records<Number> first_of(const View& c, std::size_t k, Number* bodies) {
  return {bodies, c.first + k};
}
template <class View, class Number>
[[gnu::always_inline]] inline Records<Number> second_of(const View& c, std::size_t k, Number* bodies) {
  return {bodies, c.second + k};
}

/// Grains of mass 1 for the lanes that hold no contact. In a sweep they are at rest.
template <class V>
struct SpareGrains {
  using Number = NumberOf<V>;
  alignas(64) Number record_of[width_of<V>][record_numbers]{};

  [[gnu::always_inline]] explicit SpareGrains(const Number* velocity = nullptr) {
    for (auto& grain : record_of) {
      for (int d = 0; d < 3 && velocity; ++d) grain[d] = velocity[d];
      grain[3] = 1;
    }
  }
};

/// Records of fewer contacts than there are lanes: each other lane gets a spare grain of its own.
template <class Number, std::size_t Count>
struct FewRecords {
  Number* address[Count];

  template <class V>
  [[gnu::always_inline]] FewRecords(const Records<Number>& records, std::size_t count,
                                    SpareGrains<V>& spare) {
#pragma GCC unroll 16
    for (std::size_t l = 0; l < Count; ++l)
      address[l] = l < count ? records[l] : spare.record_of[l % width_of<V>];
  }
  [[gnu::always_inline]] Number* const* operator+(std::size_t l) const {
    return address + l;
  }
  [[gnu::always_inline]] Number* operator[](std::size_t l) const {
    return address[l];
  }
};

/// Prefetches the bodies of contacts two groups ahead: they are scattered in memory, so that the processor
/// cannot foresee them. Where the first cache holds most of them, prefetching costs 2-6 % of a sweep.
template <class View, class Number>
[[gnu::always_inline]] inline void prefetch_group(const View& c, std::size_t k, Number* bodies) {
  const std::size_t ahead = k + 2 * group_size;
  if (!c.far || ahead + group_size > c.end) return;
#pragma GCC unroll 16
  for (std::size_t l = 0; l < group_size; ++l) {
    __builtin_prefetch(bodies + c.first[ahead + l], 1);
    __builtin_prefetch(bodies + c.second[ahead + l], 1);
  }
}

/// Two grains, or a grain and a wall, seen from their contact.
template <class V>
struct Meeting {
  Space<V> du;  ///< u_i - u_j
  Space<V> w;   ///< w_i + w_j
  V w_nn;       ///< 1/m_i + 1/m_j
  V spin;       ///< sum of the spin mobilities
};

/// Fills a meeting from columns.
template <bool Friction, class V>
[[gnu::always_inline]] inline Meeting<V> meeting_of(const V (&column)[8]) {
  Meeting<V> m;
  m.du = {column[0], column[1], column[2]};
  m.w_nn = column[3];
  if constexpr (Friction) {
    m.w = {column[4], column[5], column[6]};
    m.spin = column[7];
  }
  return m;
}

/// Reads W pairs; or, without reading b, W grains, whose du, w, 1/m and spin are their own.
template <bool Friction, bool Pair, class Grains>
[[gnu::always_inline]] inline Meeting<Quad> gather(const Grains& a, const Grains& b, Quad) {
  const Quad sign = {-1, -1, -1, 1};
  Quad column[8];
#pragma GCC unroll 4
  for (int l = 0; l < 4; ++l) {
    column[l] = load<Quad>(a[l]);
    if constexpr (Pair) column[l] = fused(load<Quad>(b[l]), sign, column[l]);
  }
  swap_rows_and_columns(column[0], column[1], column[2], column[3]);
  if constexpr (Friction) {
#pragma GCC unroll 4
    for (int l = 0; l < 4; ++l) {
      column[4 + l] = load<Quad>(a[l] + 4);
      if constexpr (Pair) column[4 + l] = column[4 + l] + load<Quad>(b[l] + 4);
    }
    swap_rows_and_columns(column[4], column[5], column[6], column[7]);
  }
  return meeting_of<Friction>(column);
}

/// W = 8, of floats without friction: contacts 0..3 on the left, 4..7 on the right.
template <bool Friction, bool Pair, class Grains>
requires(!Friction)
    [[gnu::always_inline]] inline Meeting<NarrowOctet> gather(const Grains& a, const Grains& b, NarrowOctet) {
  const NarrowOctet sign = {-1, -1, -1, 1, -1, -1, -1, 1};
  NarrowOctet column[8];
#pragma GCC unroll 4
  for (int l = 0; l < 4; ++l) {
    column[l] = load_halves(a[l], a[l + 4]);
    if constexpr (Pair) column[l] = fused(load_halves(b[l], b[l + 4]), sign, column[l]);
  }
  swap_rows_and_columns(column[0], column[1], column[2], column[3]);
  return meeting_of<false>(column);
}

/// W = 8, of doubles or floats.
template <bool Friction, bool Pair, class V, class Grains>
requires Friction [[gnu::always_inline]] inline Meeting<V> gather(const Grains& a, const Grains& b, V) {
  const V sign = {-1, -1, -1, 1, 1, 1, 1, 1};
  V column[8];
#pragma GCC unroll 8
  for (int l = 0; l < 8; ++l) {
    column[l] = load<V>(a[l]);
    if constexpr (Pair) column[l] = fused(load<V>(b[l]), sign, column[l]);
  }
  transpose(column);
  return meeting_of<Friction>(column);
}

/// Adds dr to the grains a and, if there is a second one, takes it from b.
template <bool Friction, bool Pair, class Grains>
[[gnu::always_inline]] inline void scatter(const Grains& a, const Grains& b, const Space<Quad>& n,
                                           const Space<Quad>& dr) {
  Quad row[4] = {dr.x, dr.y, dr.z, Quad{}};
  swap_rows_and_columns(row[0], row[1], row[2], row[3]);
#pragma GCC unroll 4
  for (int l = 0; l < 4; ++l) {
    const Quad i = load<Quad>(a[l]);
    store(a[l], fused(spread_last(i), row[l], i));
    if constexpr (Pair) {
      const Quad j = load<Quad>(b[l]);
      store(b[l], fused(-spread_last(j), row[l], j));
    }
  }
  if constexpr (Friction) {
    const Space<Quad> turn = fused_cross(dr, n);
    Quad turns[4] = {turn.x, turn.y, turn.z, Quad{}};
    swap_rows_and_columns(turns[0], turns[1], turns[2], turns[3]);
#pragma GCC unroll 4
    for (int l = 0; l < 4; ++l) {
      const Quad i = load<Quad>(a[l] + 4);
      store(a[l] + 4, fused(spread_last(i), turns[l], i));
      if constexpr (Pair) {
        const Quad j = load<Quad>(b[l] + 4);
        store(b[l] + 4, fused(spread_last(j), turns[l], j));
      }
    }
  }
}

template <bool Friction, bool Pair, class Grains>
requires(!Friction) [[gnu::always_inline]] inline void scatter(const Grains& a, const Grains& b,
                                                               const Space<NarrowOctet>& /*n*/,
                                                               const Space<NarrowOctet>& dr) {
  NarrowOctet row[4] = {dr.x, dr.y, dr.z, NarrowOctet{}};
  swap_rows_and_columns(row[0], row[1], row[2], row[3]);
#pragma GCC unroll 4
  for (int l = 0; l < 4; ++l) {
    const NarrowOctet i = load_halves(a[l], a[l + 4]);
    store_halves(a[l], a[l + 4], fused(spread_last(i), row[l], i));
    if constexpr (Pair) {
      const NarrowOctet j = load_halves(b[l], b[l + 4]);
      store_halves(b[l], b[l + 4], fused(-spread_last(j), row[l], j));
    }
  }
}

template <bool Friction, bool Pair, class V, class Grains>
requires Friction [[gnu::always_inline]] inline void scatter(const Grains& a, const Grains& b,
                                                             const Space<V>& n, const Space<V>& dr) {
  const V velocity = {-0.0, -0.0, -0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
  const Space<V> turn = fused_cross(dr, n);
  V row[8] = {dr.x, dr.y, dr.z, V{}, turn.x, turn.y, turn.z, V{}};
  transpose(row);
  // All loads first: no load then waits for the address of a store before it.
  V i[8], j[8];
#pragma GCC unroll 8
  for (int l = 0; l < 8; ++l) {
    i[l] = load<V>(a[l]);
    if constexpr (Pair) j[l] = load<V>(b[l]);
  }
#pragma GCC unroll 8
  for (int l = 0; l < 8; ++l) {
    store(a[l], fused(spread_last(i[l]), row[l], i[l]));
    if constexpr (Pair) store(b[l], fused(spread_last(j[l]), flip(row[l], velocity), j[l]));
  }
}

}  // namespace
}  // namespace talus
