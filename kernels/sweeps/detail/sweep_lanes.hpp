#pragma once

/// The sweep of kernels/sweeps/sweep.hpp on W = 4 or 8 contacts at a time.
///
/// Contacts stand in groups of up to 16 that share no grain, so that sweeping a group at once is sweeping its
/// contacts one after the other. In each group three phases follow one another, each without dependencies
/// inside:
///   gather   record_i -+ record_j while they are rows of four, then one transposition: u_i - u_j, w_i + w_j,
///            1/m_i + 1/m_j and the sum of the spin mobilities, as lanes;
///   compute  the law, without branches;
///   scatter  one transposition of (dr, dr x n) back to rows, then record += mobility * row: no record is
///            transposed for its mobility.
/// Per contact: 2 records of 64 bytes read and written, 56 bytes of contact read and 24 written, about 108
/// flop, 1.5 shuffles of 8 lanes. In a group that is not full the free lanes read n = r = bias = 0 and meet a
/// grain of their own of mass 1 at rest, so that nothing happens there.

#include "kernels/law/contact_law.hpp"
#include "kernels/sweeps/detail/record_lanes.hpp"

namespace talus {
namespace {

/// Contacts that a kernel works on at once: W x blocks of them, from place `k` of the columns on. The columns
/// stay as they are, as those that a scene does not need are null.
template <class Number>
struct Slice {
  ContactViewOf<Number> of;
  std::size_t k;
};

/// Where their impulses are written.
template <class Number>
struct Target {
  ImpulseViewOf<Number> of;
  std::size_t k;
};

template <bool Friction, class V, class Only>
[[gnu::always_inline]] inline Space<V> load_impulse(const Slice<NumberOf<V>>& c, std::size_t at, Only only,
                                                    const Space<V>& n) {
  if constexpr (Friction)
    return {load<V>(c.of.rx + c.k, at, only), load<V>(c.of.ry + c.k, at, only),
            load<V>(c.of.rz + c.k, at, only)};
  else
    return load<V>(c.of.rn + c.k, at, only) * n;
}

template <bool Friction, class V>
[[gnu::always_inline]] inline Space<V> relative_velocity(const Meeting<V>& m, const Space<V>& n) {
  if constexpr (Friction) return less_cross(m.du, m.w, n);
  return m.du;
}

/// Friction of the contacts in the lanes: of all the same, or of each its own.
struct OneFriction {
  double mu;
  template <class V, class Only>
  [[gnu::always_inline]] NumberOf<V> of(const Slice<NumberOf<V>>&, std::size_t, Only) const {
    return static_cast<NumberOf<V>>(mu);
  }
};
struct OwnFriction {
  [[gnu::always_inline]] explicit OwnFriction(double) {}
  template <class V, class Only>
  [[gnu::always_inline]] V of(const Slice<NumberOf<V>>& c, std::size_t at, Only only) const {
    return load<V>(c.of.mu + c.k, at, only);
  }
};

/// A plain sweep begins where the last one ended.
struct PlainStart {
  static constexpr double omega = 1;
  PlainStart from(std::size_t) const { return {}; }
  template <class V, class Only>
  [[gnu::always_inline]] Space<V> begin(const Space<V>& s, std::size_t, Only) const {
    return s;
  }
  template <class V, class Only>
  [[gnu::always_inline]] V begin(V s, std::size_t, Only) const {
    return s;
  }
  template <class V, class Only>
  [[gnu::always_inline]] void end(const V&, const V&, std::size_t, Only) const {}
};

/// Momentum, with the steps of the contacts from some place on.
struct MomentumStart {
  float *x, *y, *z, *n;
  double beta, omega;
  std::size_t k = 0;
  [[gnu::always_inline]] MomentumStart from(std::size_t place) const {
    return {x, y, z, n, beta, omega, place};
  }
  template <class V, class Only>
  [[gnu::always_inline]] Space<V> begin(const Space<V>& s, std::size_t at, Only only) const {
    return add_scaled(V{} + static_cast<NumberOf<V>>(beta),
                      Space<V>{load<V>(x + k, at, only), load<V>(y + k, at, only), load<V>(z + k, at, only)},
                      s);
  }
  template <class V, class Only>
  [[gnu::always_inline]] V begin(V s, std::size_t at, Only only) const {
    return fused(V{} + static_cast<NumberOf<V>>(beta), load<V>(n + k, at, only), s);
  }
  template <class V, class Only>
  [[gnu::always_inline]] void end(const Space<V>& s, const Space<V>& s_new, std::size_t at, Only only) const {
    store(x + k, at, s_new.x - s.x, only);
    store(y + k, at, s_new.y - s.y, only);
    store(z + k, at, s_new.z - s.z, only);
  }
  template <class V, class Only>
  [[gnu::always_inline]] void end(V s, V s_new, std::size_t at, Only only) const {
    store(n + k, at, s_new - s, only);
  }
};

template <class V, class Only>
[[gnu::always_inline]] inline Space<V> load_normal(const Slice<NumberOf<V>>& c, std::size_t at, Only only) {
  return {load<V>(c.of.nx + c.k, at, only), load<V>(c.of.ny + c.k, at, only),
          load<V>(c.of.nz + c.k, at, only)};
}

/// Without drift, velocities of bodies are those of their records, and those of walls are theirs.
struct NoDrift {
  [[gnu::always_inline]] void enter(std::size_t) const {}
  [[gnu::always_inline]] NoDrift from(std::size_t) const { return {}; }
  template <class V, class Only>
  [[gnu::always_inline]] void add_to(Space<V>&, std::size_t, Only) const {}
  template <class V, class Only>
  [[gnu::always_inline]] void take(const Slice<NumberOf<V>>&, Meeting<V>&, std::size_t, Only) const {}
  template <class V, class Only>
  [[gnu::always_inline]] void give(const Slice<NumberOf<V>>&, const Space<V>&, std::size_t, Only) const {}
};
/// With drift, the second body of each contact stands for an image that moves against it, or the material of
/// a wall moves against the wall.
template <class Number>
struct PairDrift {
  const Number *x, *y, *z;
  [[gnu::always_inline]] void enter(std::size_t) const {}
  [[gnu::always_inline]] PairDrift from(std::size_t k) const { return {x + k, y + k, z + k}; }
  template <class V, class Only>
  [[gnu::always_inline]] Space<V> velocity(std::size_t at, Only only) const {
    return {load<V>(x, at, only), load<V>(y, at, only), load<V>(z, at, only)};
  }
  /// Makes the velocity of a wall that of its material.
  template <class V, class Only>
  [[gnu::always_inline]] void add_to(Space<V>& wall, std::size_t at, Only only) const {
    wall = wall + velocity<V>(at, only);
  }
  template <class V, class Only>
  [[gnu::always_inline]] void take(const Slice<Number>&, Meeting<V>& m, std::size_t at, Only only) const {
    m.du = m.du - velocity<V>(at, only);
  }
  template <class V, class Only>
  [[gnu::always_inline]] void give(const Slice<Number>&, const Space<V>&, std::size_t, Only) const {}
};

/// How the contacts of a chunk are swept: their friction, where they start, and their drift, which is what
/// moves their bodies besides the records. It hears of each group that begins (enter), changes the velocities
/// that contacts see (take) and is given their impulses.
template <class Mu, class Start, class Drift = NoDrift>
struct SweepRule {
  Mu friction;
  Start start;
  Drift drift;
  [[gnu::always_inline]] SweepRule from(std::size_t k) const {
    return {friction, start.from(k), drift.from(k)};
  }
};

/// The input of the law for contacts in lanes, from the motion of their bodies.
template <bool Friction, class V, class Only>
[[gnu::always_inline]] inline Approach<V> approach_of(const Slice<NumberOf<V>>& c, std::size_t at, Only only,
                                                      const Meeting<V>& m) {
  const Space<V> n = load_normal<V>(c, at, only);
  V w_tt{};
  if constexpr (Friction) w_tt = m.w_nn + m.spin;
  return {n, relative_velocity<Friction>(m, n), load<V>(c.of.bias + c.k, at, only), m.w_nn, w_tt};
}

/// Solves the law of the contacts from `at` on: stores the new impulse and returns it less the one that the
/// velocities contain. Without friction only the component along the normal exists.
template <bool Friction, class V, class Rule, class Only>
[[gnu::always_inline]] inline Space<V> renew_impulse(const Slice<NumberOf<V>>& c,
                                                     const Target<NumberOf<V>>& out, std::size_t at,
                                                     Only only, const Approach<V>& contact,
                                                     const Rule& rule) {
  const V omega = V{} + static_cast<NumberOf<V>>(rule.start.omega);
  if constexpr (Friction) {
    const Space<V> s = load_impulse<true, V>(c, at, only, contact.n), r = rule.start.begin(s, at, only);
    const Space<V> r_new = solve_law(r, contact, rule.friction.template of<V>(c, at, only), omega);
    store(out.of.x + out.k, at, r_new.x, only);
    store(out.of.y + out.k, at, r_new.y, only);
    store(out.of.z + out.k, at, r_new.z, only);
    rule.start.end(s, r_new, at, only);
    return r_new - r;
  } else {
    const V s = load<V>(c.of.rn + c.k, at, only), r_n = rule.start.begin(s, at, only);
    const V r_n_new = solve_normal(r_n, fused_dot(contact.v, contact.n) + contact.bias, contact.w_nn, omega);
    store(out.of.n + out.k, at, r_n_new, only);
    rule.start.end(s, r_n_new, at, only);
    return (r_n_new - r_n) * contact.n;
  }
}

/// Blocks x W contacts in three phases.
template <bool Friction, class V, int Blocks, class Rule, class Grains, class Only>
[[gnu::always_inline]] inline void sweep_block(const Slice<NumberOf<V>>& c, const Target<NumberOf<V>>& out,
                                               const Grains& a, const Grains& b, const Rule& rule,
                                               Only only) {
  constexpr int W = width_of<V>;
  Meeting<V> m[Blocks];
  Space<V> dr[Blocks];
#pragma GCC unroll 4
  for (int k = 0; k < Blocks; ++k) m[k] = gather<Friction, true>(a + W * k, b + W * k, V{});
#pragma GCC unroll 4
  for (int k = 0; k < Blocks; ++k) {
    const auto at = static_cast<std::size_t>(W * k);
    rule.drift.take(c, m[k], at, only);
    dr[k] = renew_impulse<Friction>(c, out, at, only, approach_of<Friction>(c, at, only, m[k]), rule);
    rule.drift.give(c, dr[k], at, only);
  }
#pragma GCC unroll 4
  for (int k = 0; k < Blocks; ++k)
    scatter<Friction, true>(a + W * k, b + W * k, load_normal<V>(c, static_cast<std::size_t>(W * k), only),
                            dr[k]);
}

/// Blocks of W contacts that go through the phases together: more would not stay in registers.
constexpr int blocks_at_once = 2;

constexpr std::size_t minimum(std::size_t a, std::size_t b) {
  return a < b ? a : b;
}

/// Contacts [begin, begin + count) of a chunk.
struct ContactRun {
  std::size_t begin, count;
};

/// The last contacts of a group, fewer than fill its blocks.
template <bool Friction, class V, int Blocks, class Rule, class Number>
[[gnu::always_inline]] inline void sweep_rest(const ContactViewOf<Number>& c, const ImpulseViewOf<Number>& r,
                                              ContactRun run, Number* bodies, SpareGrains<V>& spare,
                                              const Rule& rule) {
  constexpr std::size_t room = width_of<V> * Blocks;
  const auto [k, count] = run;
  const FewRecords<Number, room> a(first_of(c, k, bodies), count, spare),
      b(second_of(c, k, bodies), count, spare);
  sweep_block<Friction, V, Blocks>({c, k}, {r, k}, a, b, rule.from(k), FirstLanes{count});
}

template <bool Friction, class V, class Rule, class Number>
[[gnu::always_inline]] inline void sweep_grains_by(const Rule& rule_of_chunk,
                                                   const ContactViewOf<Number>& view,
                                                   const ImpulseViewOf<Number>& impulses, Number* bodies) {
  constexpr std::size_t W = width_of<V>, at_once = W * blocks_at_once;
  const ContactViewOf<Number> c = view;  // local ones, so that no store can change them
  const ImpulseViewOf<Number> r = impulses;
  const Rule rule = rule_of_chunk;
  SpareGrains<V> spare;
  const std::uint8_t* group = c.group;
  for (std::size_t k = c.begin; k < c.end; ++group) {
    const std::size_t end = k + *group;
    prefetch_group(c, k, bodies);
    rule.drift.enter(k);
    for (; k + at_once <= end; k += at_once)
      sweep_block<Friction, V, blocks_at_once>({c, k}, {r, k}, first_of(c, k, bodies),
                                               second_of(c, k, bodies), rule.from(k), AllLanes{});
    if (k + W < end)
      sweep_rest<Friction, V, blocks_at_once>(c, r, {k, end - k}, bodies, spare, rule);
    else if (k < end)
      sweep_rest<Friction, V, 1>(c, r, {k, end - k}, bodies, spare, rule);
    k = end;
  }
}

template <class Mu>
[[gnu::always_inline]] inline SweepRule<Mu, PlainStart> plain_rule(double mu) {
  return {Mu{mu}, {}, {}};
}
template <class Mu>
[[gnu::always_inline]] inline SweepRule<Mu, MomentumStart> momentum_rule(double mu, const MomentumView& m) {
  return {Mu{mu}, {m.x, m.y, m.z, m.n, m.beta, m.omega}, {}};
}

/// work(drift) with the drifts of contacts, or with NoDrift where they have none. Asked once for a chunk: to
/// ask at every block of contacts takes 3 to 4 % more instructions without friction.
template <class Number, class Work>
[[gnu::always_inline]] inline auto with_drift(const ContactViewOf<Number>& c, const Work& work) {
  return c.vx ? work(PairDrift<Number>{c.vx, c.vy, c.vz}) : work(NoDrift{});
}
/// work(rule) with the rule and these drifts.
template <class Mu, class Start, class Number, class Work>
[[gnu::always_inline]] inline void with_drift(const SweepRule<Mu, Start>& rule,
                                              const ContactViewOf<Number>& c, const Work& work) {
  with_drift(
      c, [&](const auto& drift) __attribute__((always_inline)) {
        work(SweepRule<Mu, Start, std::remove_cvref_t<decltype(drift)>>{rule.friction, rule.start, drift});
      });
}

/// Sweeps grains by the rule, with their drifts where contacts have any.
template <bool Friction, class V, class Mu, class Start, class Number>
[[gnu::always_inline]] inline void sweep_grains_of(const SweepRule<Mu, Start>& of_chunk,
                                                   const ContactViewOf<Number>& c,
                                                   const ImpulseViewOf<Number>& r, Number* bodies) {
  with_drift(
      of_chunk, c, [&](const auto& rule) __attribute__((always_inline)) {
        sweep_grains_by<Friction, V>(rule, c, r, bodies);
      });
}

template <bool Friction, int W, class Mu>
void sweep_grains(const ContactView& c, const ImpulseView& r, double* bodies, double mu) {
  sweep_grains_of<Friction, Lanes<W>>(plain_rule<Mu>(mu), c, r, bodies);
}

template <bool Friction, int W, class Mu>
void momentum_grains(const ContactView& c, const ImpulseView& r, double* bodies, double mu,
                     const MomentumView& momentum) {
  sweep_grains_of<Friction, Lanes<W>>(momentum_rule<Mu>(mu, momentum), c, r, bodies);
}

template <bool Friction, class V, class Mu>
void single_grains(const SingleContactView& c, const SingleImpulseView& r, float* bodies, double mu,
                   const MomentumView& momentum) {
  sweep_grains_of<Friction, V>(momentum_rule<Mu>(mu, momentum), c, r, bodies);
}

/// V += M^-1 H r for W contacts.
template <bool Friction, bool Pair, int W, class Grains, class Only>
[[gnu::always_inline]] inline void accumulate_block(const Slice<double>& c, const Grains& a, const Grains& b,
                                                    Only only) {
  const auto n = load_normal<Lanes<W>>(c, 0, only);
  scatter<Friction, Pair>(a, b, n, load_impulse<Friction, Lanes<W>>(c, 0, only, n));
}

template <bool Friction, int W>
void accumulate_grains(const ContactView& view, double* bodies) {
  const ContactView c = view;
  SpareGrains<Lanes<W>> spare;
  const std::uint8_t* group = c.group;
  for (std::size_t k = c.begin; k < c.end; ++group) {
    const std::size_t end = k + *group;
    prefetch_group(c, k, bodies);
    for (; k + W <= end; k += W)
      accumulate_block<Friction, true, W>({c, k}, first_of(c, k, bodies), second_of(c, k, bodies),
                                          AllLanes{});
    if (k == end) continue;
    const FewRecords<double, W> a(first_of(c, k, bodies), end - k, spare),
        b(second_of(c, k, bodies), end - k, spare);
    accumulate_block<Friction, true, W>({c, k}, a, b, FirstLanes{end - k});
    k = end;
  }
}

}  // namespace
}  // namespace talus
