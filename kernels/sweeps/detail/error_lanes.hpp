#pragma once

/// The error of kernels/sweeps/sweep.hpp on W = 4 or 8 contacts at a time. It reads only, so that any
/// contacts may stand side by side. Sums are kept in 8 lanes, contact k of a range in lane k mod 8, whatever
/// W is.

#include "kernels/law/contact_law.hpp"
#include "kernels/sweeps/detail/advance_lanes.hpp"
#include "kernels/sweeps/detail/sweep_lanes.hpp"

namespace talus {
namespace {

template <class V>
struct ErrorLanes {
  V residual2{}, residual_max2{}, impulse2{}, velocity2{};
  Space<V> wall_impulse{};
  V active{};
};

template <bool Friction, class V, class Only>
[[gnu::always_inline]] inline void add_error(const Slice<double>& c, Only only, const Space<V>& n,
                                             const Space<V>& v, V w_nn, double mu, ErrorLanes<V>& sums) {
  const V bias = load<V>(c.bias, 0, only);
  LawError<V> error;
  if constexpr (Friction)
    error = error_of_law(load_impulse<true, V>(c, 0, only, n), n, v, bias, w_nn, mu);
  else
    error = error_of_law(load<V>(c.rn, 0, only), fused_dot(v, n) + bias, w_nn);
  sums.impulse2 += error.impulse2;
  sums.velocity2 += error.velocity2;
  sums.residual2 += error.residual2;
  sums.residual_max2 = sums.residual_max2 < error.residual2 ? error.residual2 : sums.residual_max2;
  sums.active += error.r_n > 0 ? V{} + 1.0 : V{};
}

/// 1/M of the bodies whose copies these are, by which the error counts.
template <class V, class Grains>
[[gnu::always_inline]] inline V whole(const Grains& a, const std::uint32_t* begin, std::size_t count,
                                      const std::uint16_t* parts) {
  V inv_mass = V{} + 1.0;
  for (std::size_t l = 0; l < count; ++l) inv_mass[l] = a[l][3] / parts[begin[l] / record];
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
      total.wall_impulse[0] += part.wall_impulse.x[l];
      total.wall_impulse[1] += part.wall_impulse.y[l];
      total.wall_impulse[2] += part.wall_impulse.z[l];
      active += part.active[l];
    }
  total.active = static_cast<std::int64_t>(active);
  return total;
}

/// Adds up the error of `count` <= W contacts from k on, whose bodies are a, b.
template <bool Friction, bool AtWall, int W, class Only, class Grains>
[[gnu::always_inline]] inline void error_block(const ContactView& c, std::size_t k, std::size_t count,
                                               Only only, const Grains& a, const Grains& b, double mu,
                                               const double* wall, double wall_inv_mass,
                                               const std::uint16_t* parts, ErrorLanes<Lanes<W>>& sums) {
  using V = Lanes<W>;
  const Slice<double> own = slice(c, k);
  const Space<V> n = load_normal<V>(own, 0, only);
  Meeting<V> m = gather<Friction, !AtWall>(a, b, V{});
  if (parts) {
    m.w_nn = whole<V>(a, c.first + k, count, parts);
    if constexpr (!AtWall) m.w_nn = m.w_nn + whole<V>(b, c.second + k, count, parts);
  }
  if constexpr (AtWall) {
    m.du = m.du - Space<V>{V{} + wall[0], V{} + wall[1], V{} + wall[2]};
    m.w_nn = m.w_nn + wall_inv_mass;
    sums.wall_impulse = sums.wall_impulse + load_impulse<Friction, V>(own, 0, only, n);
  }
  add_error<Friction>(own, only, n, relative_velocity<Friction>(m, n), m.w_nn, mu, sums);
}

/// `wall` is null between grains.
template <bool Friction, bool AtWall, int W>
[[gnu::always_inline]] inline ErrorTotals error_of(const ContactView& view, const double* bodies, double mu,
                                                   const double* wall, double wall_inv_mass,
                                                   const std::uint16_t* parts) {
  const ContactView c = view;
  ErrorLanes<Lanes<W>> sums[8 / W];
  std::size_t k = c.begin, lanes = 0;
  // At a wall nothing is read of b.
  const auto second = [&](std::size_t at) {
    return AtWall ? first_of(c, at, bodies) : second_of(c, at, bodies);
  };
  for (; k + W <= c.end; k += W, lanes = (lanes + 1) % (8 / W)) {
    if (!AtWall && (k - c.begin) % group_size == 0) prefetch_group(c, k, bodies);
    error_block<Friction, AtWall, W>(c, k, W, AllLanes{}, first_of(c, k, bodies), second(k), mu, wall,
                                     wall_inv_mass, parts, sums[lanes]);
  }
  if (const std::size_t rest = c.end - k; rest > 0) {
    // A lane without a contact sees no motion, and so no error.
    SpareGrains<Lanes<W>> spare(wall);
    const FewRecords<const double, W> a(first_of(c, k, bodies), rest, spare), b(second(k), rest, spare);
    error_block<Friction, AtWall, W>(c, k, rest, FirstLanes{rest}, a, b, mu, wall, wall_inv_mass, parts,
                                     sums[lanes]);
  }
  return add_lanes<W>(sums);
}

template <bool Friction, int W>
ErrorTotals error_grains(const ContactView& c, const double* bodies, double mu, const std::uint16_t* parts) {
  return error_of<Friction, false, W>(c, bodies, mu, nullptr, 0, parts);
}
template <bool Friction, int W>
ErrorTotals error_wall(const ContactView& c, const double* bodies, double mu, const double* wall,
                       double wall_inv_mass, const std::uint16_t* parts) {
  return error_of<Friction, true, W>(c, bodies, mu, wall, wall_inv_mass, parts);
}

template <bool Friction, int W>
constexpr LaneKernels kernels_of_lanes = {
    sweep_grains<Friction, W>,      momentum_grains<Friction, W>,         sweep_wall<Friction, W>,
    momentum_wall<Friction, W>,     single_grains<Friction, NarrowOctet>, single_wall<Friction, NarrowOctet>,
    accumulate_grains<Friction, W>, accumulate_wall<Friction, W>,         error_grains<Friction, W>,
    error_wall<Friction, W>,        advance_bodies<Lanes<W>, double>,     advance_bodies<NarrowOctet, float>};

}  // namespace
}  // namespace talus
