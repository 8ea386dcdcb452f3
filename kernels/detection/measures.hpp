#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/detection/contacts.hpp"
#include "kernels/detection/domain.hpp"
#include "kernels/shapes/clump.hpp"

namespace talus {

/// Sums over the contacts of some chunks at the end of the step; add them in a fixed order only.
struct ContactSums {
  std::int64_t overlapping = 0;  ///< contacts with gap < 0
  std::int64_t passed = 0;       ///< pairs that went through one another (Contacts::passed)
  double penetration = 0;        ///< sum of -gap over them [m]
  double penetration_max = 0;    ///< [m]
  double deepest = 0;            ///< largest -gap over the smaller radius of the two that touch; StepGraph
                                 ///< adds that of candidates that are no contacts (unseen.hpp)
  Eigen::Matrix3d moment = Eigen::Matrix3d::Zero();  ///< sum of r (x) l [N s m], l the branch vector: h V
                                                     ///< times the Love-Weber stress
  double normal_impulse = 0;                         ///< sum of r_n [N s]

  void add(const ContactSums& other);
};

/// What a wall does to the grains through its contacts.
struct WallSums {
  static constexpr std::size_t width = 4;
  Vec3 torque = Vec3::Zero();  ///< on the grains, about a point, times the time that impulses act [N m s]
  double drift = 0;            ///< sum of impulse . drift [J]: its work beyond that of its velocity

  void add_to(double* numbers) const {
    for (Eigen::Index c = 0; c < 3; ++c) numbers[c] += torque[c];
    numbers[3] += drift;
  }
};

/// Where bodies and walls are.
struct Poses {
  std::span<const Vec3> x;         ///< per slot [m]
  std::span<const double> radius;  ///< per slot [m]
  std::span<const Wall> walls;
  ClumpView clumps = {};
  Domain domain = {};
};

/// Sums of chunk `chunk` with the poses of the end of the step. The branch of a wall contact goes from the
/// nearest point of the plane or surface to the centre; of a block from the point of contact to its centre of
/// mass.
ContactSums measure_contacts(const Contacts& contacts, const Chunks& chunks, std::size_t chunk,
                             const Poses& poses);

/// Data that take the sums of a wall from the end of the step back to its middle, where impulses act.
struct WallMeasure {
  Vec3 about = Vec3::Zero();           ///< [m]
  std::span<const Velocity> velocity;  ///< of the end of the step
  double half_step = 0;                ///< [s]
};

/// Sums of chunk `chunk`, which is at a wall, with the poses of the end of the step. Impulses act where the
/// surfaces of balls stood in the middle of the step.
WallSums measure_wall(const Contacts& contacts, const Chunks& chunks, std::size_t chunk, const Poses& poses,
                      const WallMeasure& measure);

/// Normal of a contact. Its impulse on the first body [N s], whatever the storage: as the law sees it,
/// shifted by cohesion; and the one that the bodies feel.
inline Vec3 contact_normal(const Contacts& contacts, std::size_t k) {
  return {contacts.nx[k], contacts.ny[k], contacts.nz[k]};
}
inline Vec3 law_impulse(const Contacts& contacts, std::size_t k) {
  if (contacts.rn.empty()) return {contacts.rx[k], contacts.ry[k], contacts.rz[k]};
  return contacts.rn[k] * contact_normal(contacts, k);
}
inline void set_law_impulse(Contacts& contacts, std::size_t k, const Vec3& impulse) {
  if (contacts.rn.empty()) {
    contacts.rx[k] = impulse[0];
    contacts.ry[k] = impulse[1];
    contacts.rz[k] = impulse[2];
  } else {
    contacts.rn[k] = impulse.dot(contact_normal(contacts, k));
  }
}
inline Vec3 contact_impulse(const Contacts& contacts, std::size_t k) {
  const Vec3 impulse = law_impulse(contacts, k);
  if (contacts.cohesion.empty()) return impulse;
  return impulse - contacts.cohesion[k] * contact_normal(contacts, k);
}
/// Impulse of the moment of rolling resistance on the first body [N m s], of contacts that have any.
inline Vec3 contact_moment(const Contacts& contacts, std::size_t k) {
  return {contacts.mx[k], contacts.my[k], contacts.mz[k]};
}
/// Whether a contact carries: r_n > 0, or r_n + c h > 0 with cohesion.
inline bool is_active(const Contacts& contacts, std::size_t k) {
  return law_impulse(contacts, k).dot(contact_normal(contacts, k)) > 0;
}

/// The bodies of each active contact; of one at a wall its body twice.
std::vector<std::array<Slot, 2>> active_pairs(const Contacts& contacts, const Chunks& chunks);

}  // namespace talus
