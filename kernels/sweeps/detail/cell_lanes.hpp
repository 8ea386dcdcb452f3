#pragma once

/// The sweep of kernels/sweeps/detail/sweep_lanes.hpp in a cell that follows a stress: on W = 4 or 8 contacts
/// at a time, each against a copy of the cell of its own, contact k of a group against copy k.

#include "kernels/sweeps/detail/sweep_lanes.hpp"

namespace talus {
namespace {

/// Copies of a cell inside a chunk, one for each contact of a group: with 8 the second half of a group waits
/// for the first.
constexpr std::size_t cell_lanes = group_size;
constexpr std::size_t cell_freedoms_ = 6;  ///< xx, yy, zz, xy, xz, yz

/// U b/d, b/d = reach n.
template <class V>
[[gnu::always_inline]] inline Space<V> cell_velocity(const V (&u)[cell_freedoms_], const Space<V>& b) {
  return {fused(u[4], b.z, fused(u[3], b.y, u[0] * b.x)), fused(u[5], b.z, u[1] * b.y), u[2] * b.z};
}

/// The copies of a chunk, each of a share of its copy's mass: their velocity when the sweep began and what
/// each has gained since, apart, as in SplitWall.
template <class V>
struct SplitCell {
  using Number = NumberOf<V>;
  static constexpr std::size_t W = width_of<V>, parts = cell_lanes / W;
  V velocity[cell_freedoms_];
  V gained[parts][cell_freedoms_]{};
  Number inv_mass[cell_freedoms_];
  Number most = 0;              ///< of inv_mass: no contact sees a lighter cell
  std::size_t group_begin = 0;  ///< first contact of the group that is swept

  explicit SplitCell(const CellView& cell) {
    for (std::size_t k = 0; k < cell_freedoms_; ++k) {
      velocity[k] = V{} + static_cast<Number>(cell.velocity[k]);
      inv_mass[k] = static_cast<Number>(static_cast<double>(cell_lanes) * cell.inv_mass[k]);
      most = inv_mass[k] > most ? inv_mass[k] : most;
    }
  }
  /// The mean of all copies: their momentum is kept.
  void glue(const CellView& cell) const {
    for (std::size_t k = 0; k < cell_freedoms_; ++k) {
      double sum = 0;
      for (const auto& part : gained)
        for (std::size_t l = 0; l < W; ++l) sum += part[k][l];
      cell.velocity[k] += sum / static_cast<double>(cell_lanes);
    }
  }
};

/// A Drift of SweepRule: images that drift, and bodies that are moved by what the cell gains.
template <class V>
struct CellDrift {
  using Number = NumberOf<V>;
  PairDrift<Number> images;
  const Number* reach;
  SplitCell<V>* cell;
  std::size_t part = 0;  ///< of the copies, that of the first contacts
  [[gnu::always_inline]] void enter(std::size_t group) const { cell->group_begin = group; }
  [[gnu::always_inline]] CellDrift from(std::size_t k) const {
    return {images.from(k), reach + k, cell, (k - cell->group_begin) / width_of<V>};
  }
  template <class Only>
  [[gnu::always_inline]] Space<V> branch(const Slice<Number>& c, std::size_t at, Only only) const {
    return load<V>(reach, at, only) * load_normal<V>(c, at, only);
  }
  template <class Only>
  [[gnu::always_inline]] void take(const Slice<Number>& c, Meeting<V>& m, std::size_t at, Only only) const {
    images.take(c, m, at, only);
    const V of = load<V>(reach, at, only);
    V u[cell_freedoms_];
#pragma GCC unroll 6
    for (std::size_t k = 0; k < cell_freedoms_; ++k) u[k] = cell->velocity[k] + cell->gained[part_of(at)][k];
    m.du = m.du + cell_velocity(u, branch(c, at, only));
    m.w_nn = fused(of * of, V{} + cell->most, m.w_nn);
  }
  template <class Only>
  [[gnu::always_inline]] void give(const Slice<Number>& c, const Space<V>& dr, std::size_t at,
                                   Only only) const {
    const Space<V> b = branch(c, at, only);
    V(&u)[cell_freedoms_] = cell->gained[part_of(at)];
    u[0] = fused(V{} + cell->inv_mass[0], dr.x * b.x, u[0]);
    u[1] = fused(V{} + cell->inv_mass[1], dr.y * b.y, u[1]);
    u[2] = fused(V{} + cell->inv_mass[2], dr.z * b.z, u[2]);
    u[3] = fused(V{} + cell->inv_mass[3], dr.x * b.y, u[3]);
    u[4] = fused(V{} + cell->inv_mass[4], dr.x * b.z, u[4]);
    u[5] = fused(V{} + cell->inv_mass[5], dr.y * b.z, u[5]);
  }

 private:
  [[gnu::always_inline]] std::size_t part_of(std::size_t at) const {
    return part + at / width_of<V>;
  }
};

/// Sweeps grains of a cell by the rule.
template <bool Friction, class V, class Mu, class Start>
[[gnu::always_inline]] inline void sweep_cell_by(const SweepRule<Mu, Start>& rule,
                                                 const ContactViewOf<NumberOf<V>>& c,
                                                 const ImpulseViewOf<NumberOf<V>>& r, NumberOf<V>* bodies,
                                                 const CellView& cell) {
  SplitCell<V> split(cell);
  sweep_grains_by<Friction, V>(
      SweepRule<Mu, Start, CellDrift<V>>{rule.friction, rule.start, {{c.vx, c.vy, c.vz}, c.reach, &split, 0}},
      c, r, bodies);
  split.glue(cell);
}

template <bool Friction, int W, class Mu>
void sweep_cell(const ContactView& c, const ImpulseView& r, double* bodies, double mu, const CellView& cell) {
  sweep_cell_by<Friction, Lanes<W>>(plain_rule<Mu>(mu), c, r, bodies, cell);
}

template <bool Friction, int W, class Mu>
void momentum_cell(const ContactView& c, const ImpulseView& r, double* bodies, double mu,
                   const CellView& cell, const MomentumView& momentum) {
  sweep_cell_by<Friction, Lanes<W>>(momentum_rule<Mu>(mu, momentum), c, r, bodies, cell);
}

template <bool Friction, class V, class Mu>
void single_cell(const SingleContactView& c, const SingleImpulseView& r, float* bodies, double mu,
                 const CellView& cell, const MomentumView& momentum) {
  sweep_cell_by<Friction, V>(momentum_rule<Mu>(mu, momentum), c, r, bodies, cell);
}

/// What the error adds to a contact that no cell under stress moves: nothing ...
struct NoCell {
  template <class V, class Only>
  [[gnu::always_inline]] void take(const ContactView&, std::size_t, Only, Meeting<V>&) const {}
};
/// ... and to one in such a cell: `cell` has the velocity of the chunk's copy, and 1/M of the whole.
struct WholeCell {
  const CellView& cell;
  template <class V, class Only>
  [[gnu::always_inline]] void take(const ContactView& c, std::size_t at, Only only, Meeting<V>& m) const {
    V u[cell_freedoms_];
    double most = 0;
    for (std::size_t k = 0; k < cell_freedoms_; ++k) {
      u[k] = V{} + cell.velocity[k];
      most = cell.inv_mass[k] > most ? cell.inv_mass[k] : most;
    }
    const V of = load<V>(c.reach + at, 0, only);
    m.du = m.du + cell_velocity(u, of * load_normal<V>({c, at}, 0, only));
    m.w_nn = fused(of * of, V{} + most, m.w_nn);
  }
};

}  // namespace
}  // namespace talus
