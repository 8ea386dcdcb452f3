#include "kernels/measures.hpp"

#include <algorithm>

namespace talus {

void ContactSums::add(const ContactSums& other) {
  overlapping += other.overlapping;
  passed += other.passed;
  penetration += other.penetration;
  penetration_max = std::max(penetration_max, other.penetration_max);
  moment += other.moment;
  normal_impulse += other.normal_impulse;
}

Vec3 contact_normal(const Contacts& contacts, std::size_t k) {
  return {contacts.nx[k], contacts.ny[k], contacts.nz[k]};
}

Vec3 contact_impulse(const Contacts& contacts, std::size_t k) {
  if (contacts.rn.empty()) return {contacts.rx[k], contacts.ry[k], contacts.rz[k]};
  return contacts.rn[k] * contact_normal(contacts, k);
}

ContactSums measure_contacts(const Contacts& contacts, const Chunks& chunks, std::size_t chunk,
                             std::span<const Vec3> x, std::span<const double> radius,
                             std::span<const Wall> walls) {
  ContactSums sums;
  sums.passed = contacts.passed[chunk];
  const auto begin = static_cast<std::size_t>(chunks.begin[chunk]);
  for (std::size_t k = begin; k < begin + static_cast<std::size_t>(contacts.count[chunk]); ++k) {
    const auto i = static_cast<std::size_t>(contacts.first[k]);
    Vec3 branch;
    double gap;
    if (contacts.second[k] >= 0) {
      const auto j = static_cast<std::size_t>(contacts.second[k]);
      branch = x[i] - x[j];
      gap = branch.norm() - radius[i] - radius[j];
    } else {
      const Wall& wall = walls[static_cast<std::size_t>(chunks.wall[chunk])];
      const double distance = wall.normal.dot(x[i] - wall.point);
      branch = distance * wall.normal;
      gap = distance - radius[i];
    }
    if (gap < 0) {
      ++sums.overlapping;
      sums.penetration -= gap;
      sums.penetration_max = std::max(sums.penetration_max, -gap);
    }
    const Vec3 r = contact_impulse(contacts, k);
    sums.moment += r * branch.transpose();
    sums.normal_impulse += r.dot(contact_normal(contacts, k));
  }
  return sums;
}

std::vector<std::int32_t> count_active(const Contacts& contacts, const Chunks& chunks, std::size_t bodies) {
  std::vector<std::int32_t> touching(bodies, 0);
  for (std::size_t c = 0; c < chunks.size(); ++c) {
    const auto begin = static_cast<std::size_t>(chunks.begin[c]);
    for (std::size_t k = begin; k < begin + static_cast<std::size_t>(contacts.count[c]); ++k) {
      if (contact_impulse(contacts, k).dot(contact_normal(contacts, k)) <= 0) continue;
      ++touching[static_cast<std::size_t>(contacts.first[k])];
      if (contacts.second[k] >= 0) ++touching[static_cast<std::size_t>(contacts.second[k])];
    }
  }
  return touching;
}

}  // namespace talus
