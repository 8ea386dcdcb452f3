#pragma once

/// When a pair is a contact of a step, and with which bias, on one pair or on several at once: V is a double
/// or a vector of doubles (kernels/simd/lanes.hpp). Everything here has internal linkage, as there.

#include <limits>

#include "kernels/simd/lanes.hpp"

namespace talus {

/// Numbers of the rule, the same for all pairs of a step.
struct GapRule {
  double time_step;    ///< h [s]
  double alert;        ///< [m]
  double restitution;  ///< e in [0, 1], where pairs have none of their own
  double slow;         ///< [m/s] no restitution up to here, 2 h |gravity|; 0: all pairs have it
  double turning = std::numeric_limits<double>::infinity();  ///< [m] an impact turns no earlier than this
  double reflection = 0;  ///< E of Moreau's law (restitution_law.hpp); 0: the bias is that of v_n
  double reach = 0;       ///< of cohesion over the smaller radius, where pairs have none of their own
};

namespace {

/// What a comparison of V gives: a bool, or a mask of all bits of a lane.
template <class V>
using BitsOf = decltype(V{} < V{});

/// Whether a pair stays apart in this step: no nearer than the alert distance, and not closed at the speed
/// `v_n` [m/s] that it has at the end of the step without contacts.
template <class V>
[[gnu::always_inline]] inline BitsOf<V> stays_apart(V gap, V v_n, double time_step, double alert) {
  return (gap >= alert) & (gap >= -time_step * v_n);
}

template <class V>
struct GapResult {
  V bias;            ///< b [m/s]: Signorini's condition holds for v_n + b
  BitsOf<V> absent;  ///< where the pair constrains nothing in this step
};

/// Inelastic quasi-Signorini, b = max(g, 0)/h: no more than the gap is used up. With restitution, a pair
/// faster than `slow`, or of any speed where that is 0, that touches, or would meet within the step, follows
/// the impact law instead, b = e v_n: once braked to g/h, it would have lost the speed that is to rebound.
/// Where it is as far as `turning` others may stand between, and it flies on until it overlaps. Pairs that
/// others push together within the step are braked; that costs energy, so with e = 1 they fly on, too, but
/// within `reach` [m], where they may be pulled back. `v_n` [m/s] is the normal velocity at the beginning of
/// the step, `v_n_free` the one at its end without contacts. `restitution` is a number, or one per lane.
template <class V, class E>
[[gnu::always_inline]] inline GapResult<V> solve_gap(const GapRule& rule, V gap, V v_n, V v_n_free,
                                                     E restitution, V reach = {}) {
  BitsOf<V> absent = stays_apart(gap, v_n_free, rule.time_step, rule.alert);
  V bias = positive_part(gap) / rule.time_step;
  // Separating contacts too follow the impact law, as in Moreau's: with e here and 0 there, a grain caught
  // between both would gain energy.
  const auto impact = [&](BitsOf<V> quick) {
    const BitsOf<V> closes = (v_n < 0) & (gap < -rule.time_step * v_n_free);
    const BitsOf<V> meets = (gap <= 0) | (closes & (gap < rule.turning));
    bias = (quick & meets) ? restitution * v_n : bias;
    absent |= quick & (meets == BitsOf<V>{}) &
              (closes | ((V{} + restitution >= 1) & ((gap <= reach) == BitsOf<V>{})));
  };
  // Without gravity v_n = 0 is a speed like any other: what rests must not differ from what moves by
  // rounding.
  const double slow = rule.slow > 0 ? rule.slow : -1;
  if constexpr (std::same_as<E, double>) {
    if (restitution > 0) impact(absolute(v_n) > slow);
  } else {
    impact((restitution > 0) & (absolute(v_n) > slow));
  }
  if (rule.reflection > 0) bias = positive_part(bias - rule.reflection * v_n) / (1 + rule.reflection);
  return {bias, absent};
}

}  // namespace
}  // namespace talus
