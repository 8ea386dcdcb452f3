#pragma once

/// The error of kernels/sweeps/sweep.hpp on W = 4 or 8 contacts at a time. It only reads, so that any
/// contacts may be in the lanes together. Sums are kept in 8 lanes, contact k of a range in lane k mod 8,
/// whatever W is.

#include "kernels/law/contact_law.hpp"
#include "kernels/sweeps/detail/advance_lanes.hpp"
#include "kernels/sweeps/detail/cell_lanes.hpp"
#include "kernels/sweeps/detail/wall_lanes.hpp"

namespace talus {
namespace {

template <class V>
struct ErrorLanes {
  V residual2{}, residual_max2{}, impulse2{}, velocity2{}, work{};
  Space<V> wall_impulse{};
  V active{};
};

template <class V>
[[gnu::always_inline]] inline void add_error(const LawError<V>& error, ErrorLanes<V>& sums) {
  sums.impulse2 += error.impulse2;
  sums.velocity2 += error.velocity2;
  sums.residual2 += error.residual2;
  sums.work += error.work;
  sums.residual_max2 = sums.residual_max2 < error.residual2 ? error.residual2 : sums.residual_max2;
  sums.active += error.r_n > 0 ? V{} + 1.0 : V{};
}

/// What the error of a chunk is measured with.
template <class Mu, class Drift, class Cell>
struct ErrorRule {
  Mu friction;
  const WholeView& whole;
  const ContactView& contacts;
  Drift drift;
  Cell cell;
};

/// The number of lanes in use.
template <int W>
[[gnu::always_inline]] inline FirstLanes lanes_of(AllLanes) {
  return {W};
}
template <int W>
[[gnu::always_inline]] inline FirstLanes lanes_of(FirstLanes lanes) {
  return lanes;
}

/// 1/M of the whole bodies of these copies, as the error needs.
template <class V, class Grains>
[[gnu::always_inline]] inline V whole(const Grains& a, const std::uint32_t* begin, FirstLanes lanes,
                                      const std::uint16_t* parts) {
  V inv_mass = V{} + 1.0;
  for (std::size_t l = 0; l < lanes.count; ++l) inv_mass[l] = a[l][3] / parts[begin[l] / record_numbers];
  return inv_mass;
}

/// Adds up lanes in order; those of `sums` follow one another.
template <int W>
ErrorTotals add_lanes(const ErrorLanes<Lanes<W>> (&sums)[8 / W]) {
  ErrorTotals total{};
  double active = 0;
  for (const ErrorLanes<Lanes<W>>& part : sums)
    for (int l = 0; l < W; ++l) {
      total.residual2 += part.residual2[l];
      total.residual_max2 =
          total.residual_max2 < part.residual_max2[l] ? part.residual_max2[l] : total.residual_max2;
      total.impulse2 += part.impulse2[l];
      total.velocity2 += part.velocity2[l];
      total.work += part.work[l];
      total.wall_impulse[0] += part.wall_impulse.x[l];
      total.wall_impulse[1] += part.wall_impulse.y[l];
      total.wall_impulse[2] += part.wall_impulse.z[l];
      active += part.active[l];
    }
  total.active = static_cast<std::int64_t>(active);
  return total;
}

/// Adds up the error of up to W contacts from `at` on, whose bodies are a, b.
template <bool Friction, bool AtWall, int W, class Rule, class Only, class Grains>
[[gnu::always_inline]] inline void error_block(std::size_t at, Only only, const Grains& a, const Grains& b,
                                               const Rule& rule, ErrorLanes<Lanes<W>>& sums) {
  using V = Lanes<W>;
  const Slice<double> c{rule.contacts, at};
  const WholeView& of = rule.whole;
  const Space<V> n = load_normal<V>(c, 0, only);
  Meeting<V> m = gather<Friction, !AtWall>(a, b, V{});
  if (of.parts) {
    m.w_nn = whole<V>(a, c.of.first + c.k, lanes_of<W>(only), of.parts);
    if constexpr (!AtWall) m.w_nn = m.w_nn + whole<V>(b, c.of.second + c.k, lanes_of<W>(only), of.parts);
  }
  if constexpr (AtWall) {
    Space<V> wall{V{} + of.wall[0], V{} + of.wall[1], V{} + of.wall[2]};
    rule.drift.from(at).add_to(wall, 0, only);
    m.du = m.du - wall;
    m.w_nn = m.w_nn + of.wall_inv_mass;
    sums.wall_impulse = sums.wall_impulse + load_impulse<Friction, V>(c, 0, only, n);
  } else {
    rule.drift.from(at).take(c, m, 0, only);
  }
  rule.cell.take(rule.contacts, at, only, m);
  // Not approach_of, which needs w_tt and therefore gathers the spins: errors need neither.
  const Approach<V> contact{n, relative_velocity<Friction>(m, n), load<V>(c.of.bias + c.k, 0, only), m.w_nn,
                            V{}};
  if constexpr (Friction)
    add_error(
        error_of_law(load_impulse<true, V>(c, 0, only, n), contact, rule.friction.template of<V>(c, 0, only)),
        sums);
  else
    add_error(
        error_of_law(load<V>(c.of.rn + c.k, 0, only), fused_dot(contact.v, n) + contact.bias, contact.w_nn),
        sums);
}

/// A function of its own for each kind of drift: together in one the registers of either are dealt worse, 4 %
/// more instructions with friction.
template <bool Friction, bool AtWall, int W, class Mu, class Drift, class Cell>
[[gnu::noinline]] ErrorTotals error_by(const ContactView& view, const double* bodies, double mu,
                                       const WholeView& whole, const Drift& drift, const Cell& cell) {
  const ContactView c = view;
  const ErrorRule<Mu, Drift, Cell> rule{Mu{mu}, whole, c, drift, cell};
  ErrorLanes<Lanes<W>> sums[8 / W];
  std::size_t k = c.begin, lanes = 0;
  // At a wall b is not read.
  const auto second = [&](std::size_t at) {
    return AtWall ? first_of(c, at, bodies) : second_of(c, at, bodies);
  };
  for (; k + W <= c.end; k += W, lanes = (lanes + 1) % (8 / W)) {
    if (!AtWall && (k - c.begin) % group_size == 0) prefetch_group(c, k, bodies);
    error_block<Friction, AtWall, W>(k, AllLanes{}, first_of(c, k, bodies), second(k), rule, sums[lanes]);
  }
  if (const std::size_t rest = c.end - k; rest > 0) {
    // A lane without a contact sees no motion, and so no error.
    SpareGrains<Lanes<W>> spare(AtWall ? whole.wall : nullptr);
    const FewRecords<const double, W> a(first_of(c, k, bodies), rest, spare), b(second(k), rest, spare);
    error_block<Friction, AtWall, W>(k, FirstLanes{rest}, a, b, rule, sums[lanes]);
  }
  return add_lanes<W>(sums);
}

template <bool Friction, bool AtWall, int W, class Mu, class Cell = NoCell>
[[gnu::always_inline]] inline ErrorTotals error_of(const ContactView& c, const double* bodies, double mu,
                                                   const WholeView& whole, const Cell& cell = {}) {
  return with_drift(
      c, [&](const auto& drift) __attribute__((always_inline)) {
        return error_by<Friction, AtWall, W, Mu>(c, bodies, mu, whole, drift, cell);
      });
}

template <bool Friction, int W, class Mu>
ErrorTotals error_grains(const ContactView& c, const double* bodies, double mu, const WholeView& whole) {
  return error_of<Friction, false, W, Mu>(c, bodies, mu, whole);
}
template <bool Friction, int W, class Mu>
ErrorTotals error_wall(const ContactView& c, const double* bodies, double mu, const WholeView& whole) {
  return error_of<Friction, true, W, Mu>(c, bodies, mu, whole);
}

template <bool Friction, int W, class Mu>
ErrorTotals error_cell(const ContactView& c, const double* bodies, double mu, const WholeView& whole,
                       const CellView& cell) {
  return error_of<Friction, false, W, Mu>(c, bodies, mu, whole, WholeCell{cell});
}

/// `Mu` is OneFriction or OwnFriction.
template <bool Friction, int W, class Mu>
constexpr LaneKernels kernels_of_lanes = {sweep_grains<Friction, W, Mu>,
                                          momentum_grains<Friction, W, Mu>,
                                          sweep_wall<Friction, W, Mu>,
                                          momentum_wall<Friction, W, Mu>,
                                          sweep_cell<Friction, W, Mu>,
                                          momentum_cell<Friction, W, Mu>,
                                          single_grains<Friction, NarrowOctet, Mu>,
                                          single_wall<Friction, NarrowOctet, Mu>,
                                          single_cell<Friction, NarrowOctet, Mu>,
                                          accumulate_grains<Friction, W>,
                                          accumulate_wall<Friction, W>,
                                          error_grains<Friction, W, Mu>,
                                          error_wall<Friction, W, Mu>,
                                          error_cell<Friction, W, Mu>,
                                          advance_bodies<Lanes<W>, double>,
                                          advance_bodies<NarrowOctet, float>};

}  // namespace
}  // namespace talus
