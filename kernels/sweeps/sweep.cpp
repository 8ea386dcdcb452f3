#include "kernels/sweeps/sweep.hpp"

#include <algorithm>
#include <vector>

#include "kernels/sweeps/detail/scalar_sweeps.hpp"

namespace talus {

using namespace scalar;
using Portable = Sweeps<Separate>;

namespace {

template <bool Friction>
inline void store_impulse(Contacts& c, std::size_t k, V3<double> r, V3<double> n) {
  if constexpr (Friction)
    store_vector(c, k, r);
  else
    c.rn[k] = dot<Separate>(r, n);
}

}  // namespace

template <bool Friction>
void sweep_grains(Contacts& contacts, ContactRange range, std::span<Velocity> velocity, double mu) {
  Portable::sweep_grains<Friction>(contacts, range, velocity, mu);
}

template <bool Friction>
void sweep_grains(Contacts& contacts, ContactRange range, std::span<Velocity> velocity, double mu,
                  const SweepMomentum& momentum) {
  Portable::sweep_grains<Friction>(contacts, range, velocity, mu, momentum);
}

template <bool Friction>
void sweep_wall(Contacts& contacts, ContactRange range, std::span<Velocity> velocity, double mu,
                WallCopy& wall) {
  Portable::sweep_wall<Friction>(contacts, range, velocity, mu, wall);
}

template <bool Friction>
void sweep_wall(Contacts& contacts, ContactRange range, std::span<Velocity> velocity, double mu,
                WallCopy& wall, const SweepMomentum& momentum) {
  Portable::sweep_wall<Friction>(contacts, range, velocity, mu, wall, momentum);
}

template <bool Friction>
void sweep_grains(const Contacts& contacts, SingleContacts& single, ContactRange range,
                  std::span<SingleVelocity> velocity, double mu, const SweepMomentum& momentum) {
  Portable::sweep_grains<Friction>(contacts, single, range, velocity, mu, momentum);
}

template <bool Friction>
void sweep_wall(const Contacts& contacts, SingleContacts& single, ContactRange range,
                std::span<SingleVelocity> velocity, double mu, WallCopy& wall,
                const SweepMomentum& momentum) {
  Portable::sweep_wall<Friction>(contacts, single, range, velocity, mu, wall, momentum);
}

template <bool Friction>
void accumulate_grains(const Contacts& contacts, ContactRange range, std::span<Velocity> velocity) {
  Portable::accumulate_grains<Friction>(contacts, range, velocity);
}

template <bool Friction>
void accumulate_wall(const Contacts& contacts, ContactRange range, std::span<Velocity> velocity,
                     WallCopy& wall) {
  Portable::accumulate_wall<Friction>(contacts, range, velocity, wall);
}

template <bool Friction>
ErrorSums error_grains(const Contacts& contacts, ContactRange range, std::span<const Velocity> velocity,
                       double mu, Multiplicities parts) {
  return Portable::error_grains<Friction>(contacts, range, velocity, mu, parts);
}

template <bool Friction>
ErrorSums error_wall(const Contacts& contacts, ContactRange range, std::span<const Velocity> velocity,
                     double mu, const WallCopy& wall, double wall_inv_mass, Multiplicities parts) {
  return Portable::error_wall<Friction>(contacts, range, velocity, mu, wall, wall_inv_mass, parts);
}

void ErrorSums::add(const ErrorSums& other) {
  residual2 += other.residual2;
  residual_max2 = std::max(residual_max2, other.residual_max2);
  impulse2 += other.impulse2;
  velocity2 += other.velocity2;
  for (int c = 0; c < 3; ++c) wall_impulse[c] += other.wall_impulse[c];
  contacts += other.contacts;
  active += other.active;
}

void glue_copies(std::span<WallCopy> copies, std::span<const std::int32_t> which) {
  if (which.empty()) return;
  V3<double> sum{0, 0, 0};
  for (std::int32_t k : which) sum = sum + load(copies[static_cast<std::size_t>(k)].velocity);
  const V3<double> mean = (1 / static_cast<double>(which.size())) * sum;
  for (std::int32_t k : which) {
    double* velocity = copies[static_cast<std::size_t>(k)].velocity;
    velocity[0] = mean.x;
    velocity[1] = mean.y;
    velocity[2] = mean.z;
  }
}

template <bool Friction>
void copy_impulses(const Contacts& contacts, ContactRange range, std::vector<double>& out) {
  out.clear();
  for (std::size_t k = range.begin; k < range.end; ++k) {
    if constexpr (Friction) {
      out.insert(out.end(), {contacts.rx[k], contacts.ry[k], contacts.rz[k]});
    } else {
      out.push_back(contacts.rn[k]);
    }
  }
}

template <bool Friction>
void relax(Contacts& contacts, ContactRange range, std::span<const double> before,
           Multiplicities multiplicity, std::span<Velocity> velocity, WallCopy* wall) {
  for (std::size_t k = range.begin; k < range.end; ++k) {
    const auto i = static_cast<std::size_t>(contacts.first[k]);
    const auto j = static_cast<std::size_t>(std::max(contacts.second[k], 0));
    const auto m = wall ? multiplicity[i] : std::max(multiplicity[i], multiplicity[j]);
    if (m == 1) continue;
    const V3<double> n = normal_of(contacts, k);
    const V3<double> r = impulse_of<Friction>(contacts, k, n);
    const double* b = &before[(k - range.begin) * (Friction ? 3 : 1)];
    V3<double> r_before;
    if constexpr (Friction)
      r_before = load(b);
    else
      r_before = *b * n;
    const V3<double> r_new = r_before + (1.0 / m) * (r - r_before);
    if (wall)
      push<Separate, Friction>(velocity[i], *wall, n, r_new - r);
    else
      push<Separate, Friction>(velocity[i], velocity[j], n, r_new - r);
    store_impulse<Friction>(contacts, k, r_new, n);
  }
}

template void sweep_grains<true>(const Contacts&, SingleContacts&, ContactRange, std::span<SingleVelocity>,
                                 double, const SweepMomentum&);
template void sweep_wall<true>(const Contacts&, SingleContacts&, ContactRange, std::span<SingleVelocity>,
                               double, WallCopy&, const SweepMomentum&);
template void sweep_grains<false>(const Contacts&, SingleContacts&, ContactRange, std::span<SingleVelocity>,
                                  double, const SweepMomentum&);
template void sweep_wall<false>(const Contacts&, SingleContacts&, ContactRange, std::span<SingleVelocity>,
                                double, WallCopy&, const SweepMomentum&);
template void sweep_grains<true>(Contacts&, ContactRange, std::span<Velocity>, double);
template void sweep_grains<true>(Contacts&, ContactRange, std::span<Velocity>, double, const SweepMomentum&);
template void sweep_wall<true>(Contacts&, ContactRange, std::span<Velocity>, double, WallCopy&);
template void sweep_wall<true>(Contacts&, ContactRange, std::span<Velocity>, double, WallCopy&,
                               const SweepMomentum&);
template void sweep_grains<false>(Contacts&, ContactRange, std::span<Velocity>, double);
template void sweep_grains<false>(Contacts&, ContactRange, std::span<Velocity>, double, const SweepMomentum&);
template void sweep_wall<false>(Contacts&, ContactRange, std::span<Velocity>, double, WallCopy&);
template void sweep_wall<false>(Contacts&, ContactRange, std::span<Velocity>, double, WallCopy&,
                                const SweepMomentum&);
template void accumulate_grains<true>(const Contacts&, ContactRange, std::span<Velocity>);
template void accumulate_grains<false>(const Contacts&, ContactRange, std::span<Velocity>);
template void accumulate_wall<true>(const Contacts&, ContactRange, std::span<Velocity>, WallCopy&);
template void accumulate_wall<false>(const Contacts&, ContactRange, std::span<Velocity>, WallCopy&);
template ErrorSums error_grains<true>(const Contacts&, ContactRange, std::span<const Velocity>, double,
                                      Multiplicities);
template ErrorSums error_grains<false>(const Contacts&, ContactRange, std::span<const Velocity>, double,
                                       Multiplicities);
template ErrorSums error_wall<true>(const Contacts&, ContactRange, std::span<const Velocity>, double,
                                    const WallCopy&, double, Multiplicities);
template ErrorSums error_wall<false>(const Contacts&, ContactRange, std::span<const Velocity>, double,
                                     const WallCopy&, double, Multiplicities);
template void relax<true>(Contacts&, ContactRange, std::span<const double>, Multiplicities,
                          std::span<Velocity>, WallCopy*);
template void relax<false>(Contacts&, ContactRange, std::span<const double>, Multiplicities,
                           std::span<Velocity>, WallCopy*);
template void copy_impulses<true>(const Contacts&, ContactRange, std::vector<double>&);
template void copy_impulses<false>(const Contacts&, ContactRange, std::vector<double>&);

}  // namespace talus
