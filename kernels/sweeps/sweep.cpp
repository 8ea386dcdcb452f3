#include "kernels/sweeps/sweep.hpp"

#include <algorithm>
#include <vector>

#include "kernels/simd/lanes.hpp"

namespace talus {

void ErrorSums::add(const ErrorSums& other) {
  residual2 += other.residual2;
  residual_max2 = std::max(residual_max2, other.residual_max2);
  impulse2 += other.impulse2;
  velocity2 += other.velocity2;
  work += other.work;
  for (int c = 0; c < 3; ++c) wall_impulse[c] += other.wall_impulse[c];
  contacts += other.contacts;
  active += other.active;
}

namespace {

Space<double> space_of(const double* p) {
  return {p[0], p[1], p[2]};
}

/// p += s a.
void add_to(double* p, double s, const Space<double>& a) {
  p[0] += s * a.x;
  p[1] += s * a.y;
  p[2] += s * a.z;
}

/// Adds an impulse dr to the bodies of contact k, or to its grain and the copy of a wall, which moves along
/// its normal only.
template <bool Friction>
void push(const Contacts& c, std::size_t k, const Space<double>& n, const Space<double>& dr,
          std::span<Velocity> velocity, WallCopy* wall) {
  Velocity& a = velocity[static_cast<std::size_t>(c.first[k])];
  add_to(a.u, a.inv_mass, dr);
  Velocity* const b = wall ? nullptr : &velocity[static_cast<std::size_t>(c.second[k])];
  if (wall)
    add_to(wall->velocity, -wall->inv_mass * dot(n, dr), n);
  else
    add_to(b->u, -b->inv_mass, dr);
  if constexpr (Friction) {
    const Space<double> moment = cross(dr, n);
    add_to(a.w, a.spin_mobility, moment);
    if (b) add_to(b->w, b->spin_mobility, moment);
  }
}

/// v_n + b of contact k of spheres, as all damped ones are [m/s]; > 0 where it opens.
double opening(const Contacts& c, std::size_t k, const Space<double>& n, std::span<const Velocity> velocity,
               const WallCopy* wall) {
  Space<double> v = space_of(velocity[static_cast<std::size_t>(c.first[k])].u);
  v = v - space_of(wall ? wall->velocity : velocity[static_cast<std::size_t>(c.second[k])].u);
  if (wall || c.drifts_between) v = v - space_of(drift_of(c, k).data());
  return dot(v, n) + c.bias[k];
}

/// Whether contact k, which a sweep has opened, carried so little that it may end at once.
bool faded(const Contacts& c, std::size_t k, const Space<double>& n, const Space<double>& before,
           std::span<const Velocity> velocity, const WallCopy* wall) {
  const double other = wall ? wall->inv_mass : velocity[static_cast<std::size_t>(c.second[k])].inv_mass;
  const double W = velocity[static_cast<std::size_t>(c.first[k])].inv_mass + other;
  const double most = damping_thresholds.faded * opening(c, k, n, velocity, wall);
  return most > 0 && W * W * dot(before, before) <= most * most;
}

}  // namespace

void glue_copies(std::span<WallCopy> copies, std::span<const std::int32_t> which) {
  glue_vectors(which.size(),
               [&](std::size_t k) { return copies[static_cast<std::size_t>(which[k])].velocity; });
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
    const auto j = static_cast<std::size_t>(std::max(Slot{contacts.second[k]}, 0));
    const auto m = wall ? multiplicity[i] : std::max(multiplicity[i], multiplicity[j]);
    if (m == 1) continue;
    const Space<double> n{contacts.nx[k], contacts.ny[k], contacts.nz[k]};
    Space<double> r, r_before;
    if constexpr (Friction) {
      r = {contacts.rx[k], contacts.ry[k], contacts.rz[k]};
      r_before = space_of(&before[3 * (k - range.begin)]);
    } else {
      r = contacts.rn[k] * n;
      r_before = before[k - range.begin] * n;
    }
    if (r.x == 0 && r.y == 0 && r.z == 0 && faded(contacts, k, n, r_before, velocity, wall)) continue;
    const Space<double> r_new = r_before + (1.0 / m) * (r - r_before);
    push<Friction>(contacts, k, n, r_new - r, velocity, wall);
    if constexpr (Friction) {
      contacts.rx[k] = r_new.x;
      contacts.ry[k] = r_new.y;
      contacts.rz[k] = r_new.z;
    } else {
      contacts.rn[k] = dot(r_new, n);
    }
  }
}

template void relax<true>(Contacts&, ContactRange, std::span<const double>, Multiplicities,
                          std::span<Velocity>, WallCopy*);
template void relax<false>(Contacts&, ContactRange, std::span<const double>, Multiplicities,
                           std::span<Velocity>, WallCopy*);
template void copy_impulses<true>(const Contacts&, ContactRange, std::vector<double>&);
template void copy_impulses<false>(const Contacts&, ContactRange, std::vector<double>&);

}  // namespace talus
