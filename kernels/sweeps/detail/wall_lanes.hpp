#pragma once

/// The sweep of kernels/sweeps/detail/sweep_lanes.hpp between grains and a wall, on W = 4 or 8 contacts at a
/// time, each against a copy of the wall of its own.

#include "kernels/sweeps/detail/sweep_lanes.hpp"

namespace talus {
namespace {

constexpr std::size_t wall_lanes = 8;  ///< copies of a wall inside a chunk

/// The copies of a wall, one for each of 8 lanes: its velocity when the sweep began and what each has gained
/// since, apart, so that the little that a heavy wall gains is not lost in rounding; and 1/m of a lane.
template <class V>
struct SplitWall {
  using Number = NumberOf<V>;
  static constexpr int W = width_of<V>;
  Space<V> velocity;
  Space<V> gained[wall_lanes / W]{};
  Number inv_mass;
  std::size_t lanes;

  SplitWall(const WallView& wall, std::size_t contacts) : lanes(minimum(contacts, 8)) {
    const auto all = [&](int d) { return V{} + static_cast<Number>(wall.velocity[d]); };
    velocity = {all(0), all(1), all(2)};
    inv_mass = static_cast<Number>(wall.inv_mass * static_cast<double>(lanes));
  }
  void push(std::size_t part, const Space<V>& n, const Space<V>& dr) {
    gained[part] = add_scaled(-inv_mass * fused_dot(n, dr), n, gained[part]);
  }
  void glue(const WallView& wall) const {
    if (inv_mass == 0 || lanes == 0) return;
    Number x[wall_lanes], y[wall_lanes], z[wall_lanes];
    for (std::size_t k = 0; k < wall_lanes / W; ++k) {
      store(x + W * k, gained[k].x);
      store(y + W * k, gained[k].y);
      store(z + W * k, gained[k].z);
    }
    double sum[3] = {0, 0, 0};
    for (std::size_t l = 0; l < lanes; ++l) {
      sum[0] += x[l];
      sum[1] += y[l];
      sum[2] += z[l];
    }
    for (int d = 0; d < 3; ++d) wall.velocity[d] += 1 / static_cast<double>(lanes) * sum[d];
  }
};

/// The copies of a wall that a block of contacts meets.
template <class V>
struct WallPart {
  SplitWall<V>& wall;
  std::size_t part;
};

/// A block of W grains against as many copies of a wall.
template <bool Friction, class V, class Grains, class Rule, class Only>
[[gnu::always_inline]] inline void sweep_wall_block(const Slice<NumberOf<V>>& c,
                                                    const Target<NumberOf<V>>& out, const Grains& a,
                                                    const Rule& rule, Only only, WallPart<V> at) {
  Meeting<V> m = gather<Friction, false>(a, a, V{});
  Space<V> wall = at.wall.velocity + at.wall.gained[at.part];
  rule.drift.add_to(wall, 0, only);
  m.du = m.du - wall;
  Approach<V> contact = approach_of<Friction>(c, 0, only, m);
  contact.w_nn = contact.w_nn + at.wall.inv_mass;
  const Space<V> dr = renew_impulse<Friction>(c, out, 0, only, contact, rule);
  scatter<Friction, false>(a, a, contact.n, dr);
  at.wall.push(at.part, contact.n, dr);
}

template <bool Friction, class V, class Rule, class Number>
[[gnu::always_inline]] inline void sweep_wall_by(const Rule& rule_of_chunk, const ContactViewOf<Number>& view,
                                                 const ImpulseViewOf<Number>& impulses, Number* bodies,
                                                 const WallView& wall) {
  constexpr std::size_t W = width_of<V>;
  const ContactViewOf<Number> c = view;
  const ImpulseViewOf<Number> r = impulses;
  const Rule rule = rule_of_chunk;
  SplitWall<V> split(wall, c.end - c.begin);
  std::size_t k = c.begin, part = 0;
  for (; k + W <= c.end; k += W, part = (part + 1) % (wall_lanes / W))
    sweep_wall_block<Friction, V>({c, k}, {r, k}, first_of(c, k, bodies), rule.from(k), AllLanes{},
                                  {split, part});
  if (k < c.end) {
    SpareGrains<V> spare;
    const FewRecords<Number, W> a(first_of(c, k, bodies), c.end - k, spare);
    sweep_wall_block<Friction, V>({c, k}, {r, k}, a, rule.from(k), FirstLanes{c.end - k}, {split, part});
  }
  split.glue(wall);
}

/// Sweeps grains at a wall by the rule, with the drifts of the wall's material where it has any.
template <bool Friction, class V, class Mu, class Start, class Number>
[[gnu::always_inline]] inline void sweep_wall_of(const SweepRule<Mu, Start>& of_chunk,
                                                 const ContactViewOf<Number>& c,
                                                 const ImpulseViewOf<Number>& r, Number* bodies,
                                                 const WallView& wall) {
  with_drift(
      of_chunk, c, [&](const auto& rule) __attribute__((always_inline)) {
        sweep_wall_by<Friction, V>(rule, c, r, bodies, wall);
      });
}

template <bool Friction, int W, class Mu>
void sweep_wall(const ContactView& c, const ImpulseView& r, double* bodies, double mu, const WallView& wall) {
  sweep_wall_of<Friction, Lanes<W>>(plain_rule<Mu>(mu), c, r, bodies, wall);
}

template <bool Friction, int W, class Mu>
void momentum_wall(const ContactView& c, const ImpulseView& r, double* bodies, double mu,
                   const WallView& wall, const MomentumView& momentum) {
  sweep_wall_of<Friction, Lanes<W>>(momentum_rule<Mu>(mu, momentum), c, r, bodies, wall);
}

template <bool Friction, class V, class Mu>
void single_wall(const SingleContactView& c, const SingleImpulseView& r, float* bodies, double mu,
                 const WallView& wall, const MomentumView& momentum) {
  sweep_wall_of<Friction, V>(momentum_rule<Mu>(mu, momentum), c, r, bodies, wall);
}

template <bool Friction, int W>
void accumulate_wall(const ContactView& view, double* bodies, const WallView& wall) {
  using V = Lanes<W>;
  const ContactView c = view;
  SplitWall<V> split(wall, c.end - c.begin);
  const auto add = [&](const Slice<double>& own, const auto& a, std::size_t lanes, auto only) {
    const Space<V> n = load_normal<V>(own, 0, only);
    accumulate_block<Friction, false, W>(own, a, a, only);
    split.push(lanes, n, load_impulse<Friction, V>(own, 0, only, n));
  };
  std::size_t k = c.begin, lanes = 0;
  for (; k + W <= c.end; k += W, lanes = (lanes + 1) % (wall_lanes / W))
    add(Slice<double>{c, k}, first_of(c, k, bodies), lanes, AllLanes{});
  if (k < c.end) {
    SpareGrains<Lanes<W>> spare;
    const FewRecords<double, W> a(first_of(c, k, bodies), c.end - k, spare);
    add(Slice<double>{c, k}, a, lanes, FirstLanes{c.end - k});
  }
  split.glue(wall);
}

}  // namespace
}  // namespace talus
