#pragma once

/// The kernels of kernels/sweeps/sweep_kernels.hpp, one contact after the other.

#include <vector>

#include "kernels/sweeps/single_precision.hpp"
#include "tests/unit/reference_contact.hpp"

namespace talus::test {

/// Calls `work` with each contact of a range and its number.
template <bool Friction, class N, class Work>
void for_each(const Contacts& contacts, const auto& arrays, ContactRange range,
              std::span<VelocityOf<N>> velocity, WallParts<N>* wall, const Work& work) {
  for (std::size_t k = range.begin; k < range.end; ++k) {
    const V3<N> n{arrays.nx[k], arrays.ny[k], arrays.nz[k]};
    VelocityOf<N>& a = velocity[std::size_t(contacts.first[k])];
    VelocityOf<N>* const b = wall ? nullptr : &velocity[std::size_t(contacts.second[k])];
    work(Contact<Friction, N>{n, a, b, wall, (k - range.begin) % 8}, k);
  }
}

/// Friction of a contact.
double coefficient(ChunkFriction mu, const auto& arrays, std::size_t k) {
  return mu.own ? static_cast<double>(arrays.mu[k]) : mu.mu;
}

/// Of grains, or at the wall whose parts are given; sums in 8 lanes, contact k in lane k mod 8, then in
/// order.
template <bool Friction>
ErrorSums error_of(const Contacts& contacts, ContactRange range, std::span<const Velocity> velocity,
                   ChunkFriction mu, Multiplicities parts, WallParts<double>* wall) {
  std::vector<Velocity> copy(velocity.begin(), velocity.end());
  const auto whole = [&](Slot slot) {
    const auto s = std::size_t(slot);
    return parts.empty() ? velocity[s].inv_mass : velocity[s].inv_mass / parts[s];
  };
  ErrorSums lanes[8], total;
  for_each<Friction>(contacts, contacts, range, std::span(copy), wall, [&](const auto& c, std::size_t k) {
    ErrorSums& sums = lanes[(k - range.begin) % 8];
    const double w_nn = whole(contacts.first[k]) + (wall ? wall->inv_mass : whole(contacts.second[k]));
    const V3<double> r = impulse_of<Friction>(contacts, k), v = c.velocity();
    if constexpr (Friction)
      add_error<true>(sums, c.n, r, v, contacts.bias[k], w_nn, coefficient(mu, contacts, k));
    else
      add_error(sums, contacts.rn[k], v.dot(c.n) + contacts.bias[k], w_nn);
    if (wall) (V3<double>(sums.wall_impulse) + r).store(sums.wall_impulse);
  });
  for (const ErrorSums& sums : lanes) total.add(sums);
  total.contacts = std::int64_t(range.end - range.begin);
  return total;
}

template <bool Friction, class N>
void sweep(const Contacts& contacts, auto& arrays, ContactRange range, std::span<VelocityOf<N>> velocity,
           ChunkFriction mu, const SweepMomentum* momentum, WallParts<N>* wall = nullptr) {
  for_each<Friction>(contacts, arrays, range, velocity, wall, [&](const auto& c, std::size_t k) {
    solve<Friction>(c, arrays, k, coefficient(mu, arrays, k), momentum);
  });
}
template <bool Friction, class N>
void sweep(const Contacts& contacts, auto& arrays, ContactRange range, std::span<VelocityOf<N>> velocity,
           ChunkFriction mu, const SweepMomentum* momentum, WallCopy& wall, double unit = 1) {
  WallParts<N> parts(wall, range, unit);
  sweep<Friction>(contacts, arrays, range, velocity, mu, momentum, &parts);
  parts.glue(wall);
}

/// Under the names and with the parameters that SweepKernels has.
struct ReferenceSweeps {
  using Range = ContactRange;
  template <bool F>
  void sweep_grains(Contacts& c, Range r, std::span<Velocity> v, ChunkFriction mu) const {
    sweep<F>(c, c, r, v, mu, nullptr);
  }
  template <bool F>
  void sweep_grains(Contacts& c, Range r, std::span<Velocity> v, ChunkFriction mu,
                    const SweepMomentum& m) const {
    sweep<F>(c, c, r, v, mu, &m);
  }
  template <bool F>
  void sweep_grains(const Contacts& c, SingleState& single, Range r, ChunkFriction mu,
                    const SweepMomentum& m) const {
    sweep<F>(c, single.contacts, r, std::span(single.velocity), mu, &m);
  }
  template <bool F>
  void sweep_wall(Contacts& c, Range r, std::span<Velocity> v, ChunkFriction mu, WallCopy& wall) const {
    sweep<F>(c, c, r, v, mu, nullptr, wall);
  }
  template <bool F>
  void sweep_wall(Contacts& c, Range r, std::span<Velocity> v, ChunkFriction mu, WallCopy& wall,
                  const SweepMomentum& m) const {
    sweep<F>(c, c, r, v, mu, &m, wall);
  }
  template <bool F>
  void sweep_wall(const Contacts& c, SingleState& single, Range r, ChunkFriction mu, WallCopy& wall,
                  const SweepMomentum& m) const {
    sweep<F>(c, single.contacts, r, std::span(single.velocity), mu, &m, wall, single.contacts.unit);
  }
  template <bool F>
  void accumulate_grains(const Contacts& c, Range r, std::span<Velocity> v) const {
    for_each<F>(c, c, r, v, static_cast<WallParts<double>*>(nullptr),
                [&](const auto& contact, std::size_t k) { contact.push(impulse_of<F>(c, k)); });
  }
  template <bool F>
  void accumulate_wall(const Contacts& c, Range r, std::span<Velocity> v, WallCopy& wall) const {
    WallParts<double> parts(wall, r, 1);
    for_each<F>(c, c, r, v, &parts,
                [&](const auto& contact, std::size_t k) { contact.push(impulse_of<F>(c, k)); });
    parts.glue(wall);
  }
  template <bool F>
  ErrorSums error_grains(const Contacts& c, Range r, std::span<const Velocity> v, ChunkFriction mu,
                         Multiplicities parts = {}) const {
    return error_of<F>(c, r, v, mu, parts, nullptr);
  }
  template <bool F>
  ErrorSums error_wall(const Contacts& c, Range r, std::span<const Velocity> v, ChunkFriction mu,
                       const WallCopy& wall, Multiplicities parts = {}) const {
    WallParts<double> whole(wall, r, 1);
    whole.inv_mass = wall.inv_mass;
    return error_of<F>(c, r, v, mu, parts, &whole);
  }
};

}  // namespace talus::test
