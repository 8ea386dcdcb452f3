#pragma once

/// The rejections of resting_site.cpp for several sites at a time: by bounds alone, without the roots that
/// tell where a range of radii ends. Internal linkage, as everything in lanes.hpp.

#include "kernels/samples/detail/site_kernels.hpp"
#include "kernels/simd/lanes.hpp"

namespace talus {
namespace {

template <class V>
using MaskOf = decltype(V{} < V{});

template <class V>
[[gnu::always_inline]] inline bool any_set(MaskOf<V> mask) {
  long long any = mask[0];
  for (std::size_t l = 1; l < sizeof(V) / sizeof(double); ++l) any |= mask[l];
  return any != 0;
}
template <class V>
[[gnu::always_inline]] inline V smaller(V a, V b) {
  return a < b ? a : b;
}
template <class V>
[[gnu::always_inline]] inline V larger(V a, V b) {
  return a < b ? b : a;
}
template <class V>
[[gnu::always_inline]] inline V every_lane(double value) {
  return V{} + value;
}
/// Of the obstacles from `at` on.
template <class V>
[[gnu::always_inline]] inline V indices(std::size_t at) {
  V v;
  for (std::size_t l = 0; l < sizeof(V) / sizeof(double); ++l) v[l] = static_cast<double>(at + l);
  return v;
}

template <class V>
struct ObstacleLanes {
  Space<V> d;
  V e0, e1, round;
};
template <class V>
[[gnu::always_inline]] inline ObstacleLanes<V> obstacles_from(const ObstacleView& all, std::size_t k) {
  return {{load<V>(all.dx + k), load<V>(all.dy + k), load<V>(all.dz + k)},
          load<V>(all.e0 + k),
          load<V>(all.e1 + k),
          load<V>(all.round + k)};
}
template <class V>
[[gnu::always_inline]] inline ObstacleLanes<V> one_obstacle(const ObstacleView& all, std::size_t k) {
  return {{every_lane<V>(all.dx[k]), every_lane<V>(all.dy[k]), every_lane<V>(all.dz[k])},
          every_lane<V>(all.e0[k]),
          every_lane<V>(all.e1[k]),
          every_lane<V>(all.round[k])};
}

/// `SiteCurve` with the bounds of its root.
template <class V>
struct CurveLanes {
  Space<V> a, b, t;
  V root_low, root_high;
};

/// Whether k . p(r) + k0 + k1 r < -slack for all radii of the rule, beyond what rounding may change.
template <class V>
[[gnu::always_inline]] inline MaskOf<V> never_positive(const CurveLanes<V>& curve, const Space<V>& k, V k0,
                                                       V k1, V slack, const SiteRule& rule) {
  const V alpha = dot(k, curve.a) + k0, beta = dot(k, curve.b) + k1, gamma = dot(k, curve.t);
  const V most = larger(beta * rule.smallest, beta * rule.largest) +
                 larger(gamma * curve.root_low, gamma * curve.root_high);
  const V doubt =
      1e-9 * (absolute(alpha) + absolute(beta) * rule.largest + absolute(gamma) * curve.root_high);
  return alpha + most < -slack - doubt;
}

/// The curve of each lane; `dead` where there is none, or no radius for which it is real. w is the product of
/// the two directions.
template <class V>
[[gnu::always_inline]] inline CurveLanes<V> curve_of_lanes(const ObstacleLanes<V>& first,
                                                           const ObstacleLanes<V>& second, const Space<V>& w,
                                                           const SiteRule& rule, MaskOf<V>& dead) {
  const V w2 = dot(w, w);
  dead |= ~(w2 > 1e-20 * dot(first.d, first.d) * dot(second.d, second.d));
  const V over = 1 / w2;
  const Space<V> to_first = over * cross(second.d, w), to_second = over * cross(w, first.d);
  CurveLanes<V> curve;
  curve.a = first.e0 * to_first + second.e0 * to_second;
  curve.b = first.e1 * to_first + second.e1 * to_second;
  const V length = root(over);
  curve.t = (w.z < V{} ? -length : length) * w;
  const V q0 = rule.base_radius * rule.base_radius - dot(curve.a, curve.a);
  const V q1 = 2 * (rule.base_radius - dot(curve.a, curve.b)), q2 = 1 - dot(curve.b, curve.b);
  const double low = rule.smallest, high = rule.largest;
  const V at_low = q0 + low * (q1 + low * q2), at_high = q0 + high * (q1 + high * q2);
  const MaskOf<V> turns = (q1 + 2 * low * q2) * (q1 + 2 * high * q2) < V{};
  const V r = -0.5 * q1 / q2, turn = q0 + r * (q1 + r * q2);
  const V ends_low = smaller(at_low, at_high), ends_high = larger(at_low, at_high);
  const V least = turns ? smaller(ends_low, turn) : ends_low;
  const V most = turns ? larger(ends_high, turn) : ends_high;
  const V doubt = 1e-9 * (absolute(q0) + high * (absolute(q1) + high * absolute(q2)));
  curve.root_low = root(larger(V{}, least - doubt));
  curve.root_high = root(larger(V{}, most + doubt));
  dead |= most + doubt < V{};
  return curve;
}

/// Lanes in which the weight falls beside the three supports for every radius: keep_stable.
template <class V>
[[gnu::always_inline]] inline MaskOf<V> never_stable(const CurveLanes<V>& curve,
                                                     const ObstacleLanes<V>& first,
                                                     const ObstacleLanes<V>& second, V upward,
                                                     const SiteRule& rule) {
  const MaskOf<V> in_order = upward > V{};
  const V one_x = in_order ? first.d.x : second.d.x, one_y = in_order ? first.d.y : second.d.y;
  const V two_x = in_order ? second.d.x : first.d.x, two_y = in_order ? second.d.y : first.d.y;
  const V round_one = in_order ? first.round : second.round;
  const V round_two = in_order ? second.round : first.round;
  const Space<V> for_one{two_y, -two_x, V{}}, for_two{-one_y, one_x, V{}};
  const Space<V> for_base{-round_one * for_one.x - round_two * for_two.x,
                          -round_one * for_one.y - round_two * for_two.y, V{}};
  const V scale = absolute(upward), slack = rule.stable_slack * scale;
  return never_positive(curve, for_one, V{}, V{}, slack, rule) |
         never_positive(curve, for_two, V{}, V{}, slack, rule) |
         never_positive(curve, for_base, scale, V{}, slack, rule);
}

/// Whether an obstacle beside the two supports is in the way of every radius: keep_clear, several obstacles
/// at a time for the site of one lane.
template <class V>
[[gnu::always_inline]] inline bool never_clear(const CurveLanes<V>& curves, std::size_t lane,
                                               const ObstacleView& all, std::size_t first, std::size_t second,
                                               const SiteRule& rule) {
  const auto of = [lane](V v) __attribute__((always_inline)) {
    return every_lane<V>(v[lane]);
  };
  const CurveLanes<V> curve{{of(curves.a.x), of(curves.a.y), of(curves.a.z)},
                            {of(curves.b.x), of(curves.b.y), of(curves.b.z)},
                            {of(curves.t.x), of(curves.t.y), of(curves.t.z)},
                            of(curves.root_low),
                            of(curves.root_high)};
  const V slack = every_lane<V>(rule.clear_slack);
  const V not_first = every_lane<V>(static_cast<double>(first));
  const V not_second = every_lane<V>(static_cast<double>(second));
  for (std::size_t n = 0; n < all.count; n += sizeof(V) / sizeof(double)) {
    const ObstacleLanes<V> near = obstacles_from<V>(all, n);
    const Space<V> away{-near.d.x, -near.d.y, -near.d.z};
    const V index = indices<V>(n);
    if (any_set<V>(never_positive(curve, away, near.e0, near.e1, slack, rule) & (index != not_first) &
                   (index != not_second)))
      return true;
  }
  return false;
}

template <int W>
void sieve_sites(const ObstacleView& all, std::size_t one, const SiteRule& rule, unsigned char* possible) {
  using V = Lanes<W>;
  const ObstacleLanes<V> first = one_obstacle<V>(all, one);
  const V too_far = every_lane<V>(all.radius[one] + 2 * rule.largest);
  for (std::size_t k = one + 1; k < all.count; k += W) {
    const ObstacleLanes<V> second = obstacles_from<V>(all, k);
    const Space<V> apart = first.d - second.d;
    const V reach = load<V>(all.radius + k) + too_far;
    MaskOf<V> dead = dot(apart, apart) > reach * reach;
    if (any_set<V>(~dead)) {
      const Space<V> w = cross(first.d, second.d);
      const CurveLanes<V> curve = curve_of_lanes(first, second, w, rule, dead);
      dead |= never_stable(curve, first, second, w.z, rule);
      for (std::size_t l = 0; l < W && k + l < all.count; ++l)
        if (dead[l] == 0 && never_clear(curve, l, all, one, k + l, rule)) dead[l] = -1;
    }
    for (std::size_t l = 0; l < W; ++l)
      possible[k + l] = dead[l] == 0 || one == all.floor || k + l == all.floor;
  }
}

}  // namespace
}  // namespace talus
