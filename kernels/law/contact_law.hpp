#pragma once

/// The law of a contact between spheres, on one contact or on several at once: V is a double, or a vector of
/// doubles or floats with one contact per lane (kernels/simd/lanes.hpp). A lane computes to the bit what a
/// double computes. W_aa is diagonal in (normal, tangents) with two equal tangential entries, so that
/// Signorini's condition and Coulomb's friction have a closed form; blocks that are full are solved in
/// friction_cone.hpp.
///
/// Everything here has internal linkage, for the reason given in lanes.hpp.

#include "kernels/simd/lanes.hpp"

namespace talus {
namespace {

/// 1/W_nn and 1/W_tt by one division: sweeps in double precision wait for divisions. The product stays in
/// range for masses of grains, and for floats, whose masses are within a factor 1000 of their unit.
template <class V>
struct Inverses {
  V nn, tt;
};
template <class V>
[[gnu::always_inline]] inline Inverses<V> invert(V w_nn, V w_tt) {
  const V inverse = NumberOf<V>{1} / (w_nn * w_tt);
  return {inverse * w_tt, inverse * w_nn};
}

/// Signorini's condition without friction: r_n <- max(0, r_n - omega (v_n + b)/W_nn) [N s]. `closing` is
/// v_n + b [m/s]; omega in (0, 2) over-relaxes.
template <class V>
[[gnu::always_inline]] inline V solve_normal(V r_n, V closing, V w_nn, V omega) {
  return positive_part(fused(-omega, closing / w_nn, r_n));
}

/// A contact as its law sees it. n points to the first body.
template <class V>
struct Approach {
  Space<V> n;    ///< unit
  Space<V> v;    ///< relative velocity of the first body [m/s]
  V bias;        ///< b [m/s]
  V w_nn, w_tt;  ///< diagonal of W_aa [1/kg]; w_tt with friction only
};

/// Signorini-Coulomb: the impulse [N s] after r, which v is a part of:
///   r_n <- max(0, r_n - omega (v_n + b)/W_nn),   r_t <- P_{|.| <= mu r_n}(r_t - v_t/W_tt).
/// `mu` is a number, or one per lane. Over-relaxation is for the normal part only: friction gains nothing by
/// it.
template <class V, class Mu>
[[gnu::always_inline]] inline Space<V> solve_law(const Space<V>& r, const Approach<V>& contact, Mu mu,
                                                 V omega) {
  using Number = NumberOf<V>;
  const auto& [n, v, bias, w_nn, w_tt] = contact;
  const V v_n = fused_dot(v, n);
  const Inverses<V> inverse = invert(w_nn, w_tt);
  const V r_n = fused_dot(r, n);
  const V r_n_new = positive_part(fused(-omega, (v_n + bias) * inverse.nn, r_n));
  const V limit = mu * r_n_new;
  // r - v/W_tt, less what of it is normal.
  const Space<V> t = add_scaled(-fused(-inverse.tt, v_n, r_n), n, add_scaled(-inverse.tt, v, r));
  V t2 = fused_dot(t, t);
  // In floats squares vanish early: a contact that carries nothing must not keep what is left of its t.
  if constexpr (std::same_as<Number, float>) t2 = t2 + __FLT_MIN__;
  const V scale = t2 > limit * limit ? limit / root(t2) : V{} + Number{1};
  return add_scaled(scale, t, r_n_new * n);
}

/// Projection of z on the Coulomb cone about n. `mu` is a number, or one per lane.
template <class V, class Mu>
[[gnu::always_inline]] inline Space<V> project_on_cone(const Space<V>& z, const Space<V>& n, Mu mu) {
  const V z_n = fused_dot(z, n);
  const Space<V> t = add_scaled(-z_n, n, z);
  const V length = root(fused_dot(t, t));
  const V r_n = fused(V{} + mu, length, z_n) * (1 / (1 + mu * mu));
  const Space<V> edge = add_scaled(mu * r_n / length, t, r_n * n);
  // The apex first: with mu = 0 = length the other condition would hold, too.
  const auto apex = mu * length <= -z_n, inside = length <= mu * z_n;
  const auto choose = [&](V on_edge, V own) { return apex ? V{} : inside ? own : on_edge; };
  return {choose(edge.x, z.x), choose(edge.y, z.y), choose(edge.z, z.z)};
}

/// How far a contact is from its law. All but r_n and work in m^2/s^2.
template <class V>
struct LawError {
  V residual2;  ///< |natural map|^2 times W_nn^2
  V impulse2;   ///< (W_nn |r|)^2
  V velocity2;  ///< |v + b n|^2 where the contact carries or closes, else 0
  V r_n;        ///< [N s]
  V work;       ///< r_n times the root of residual2 [J]
};

/// Natural map of the De Saxce form, r - P_Kmu(r - rho (v + (b + mu |v_t|) n)) with rho = 1/W_nn.
template <class V, class Mu>
[[gnu::always_inline]] inline LawError<V> error_of_law(const Space<V>& r, const Approach<V>& contact, Mu mu) {
  const auto& [n, v, bias, w_nn, w_tt] = contact;
  const V v_0 = fused_dot(v, n), v_n = v_0 + bias;
  const Space<V> v_t = add_scaled(-v_0, n, v);
  const V v_t2 = fused_dot(v_t, v_t);
  const Space<V> v_hat = add_scaled(fused(V{} + mu, root(v_t2), v_n), n, v_t);
  const Space<V> p = w_nn * r, miss = p - project_on_cone(p - v_hat, n, mu);
  const V r_n = fused_dot(r, n), residual2 = fused_dot(miss, miss);
  return {residual2, fused_dot(p, p), ((r_n > 0) | (v_n < 0)) ? fused(v_n, v_n, v_t2) : V{}, r_n,
          r_n * root(residual2)};
}

/// The same without friction; `closing` is v_n + b [m/s].
template <class V>
[[gnu::always_inline]] inline LawError<V> error_of_law(V r_n, V closing, V w_nn) {
  const V p = w_nn * r_n, miss = p - positive_part(p - closing);
  return {miss * miss, p * p, ((r_n > 0) | (closing < 0)) ? closing * closing : V{}, r_n,
          r_n * absolute(miss)};
}

}  // namespace
}  // namespace talus
