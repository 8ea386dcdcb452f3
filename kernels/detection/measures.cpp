#include "kernels/detection/measures.hpp"

#include <Eigen/Geometry>
#include <algorithm>

#include "kernels/detection/touch.hpp"
#include "kernels/detection/wall_pairs.hpp"

namespace talus {

namespace {

/// Prefetch distance, in contacts.
constexpr std::size_t ahead = 16;

}  // namespace

void ContactSums::add(const ContactSums& other) {
  overlapping += other.overlapping;
  passed += other.passed;
  penetration += other.penetration;
  penetration_max = std::max(penetration_max, other.penetration_max);
  deepest = std::max(deepest, other.deepest);
  moment += other.moment;
  normal_impulse += other.normal_impulse;
}

ContactSums measure_contacts(const Contacts& contacts, const Chunks& chunks, std::size_t chunk,
                             const Poses& poses) {
  const auto& [x, radius, walls, clumps, domain] = poses;
  ContactSums sums;
  sums.passed = contacts.passed[chunk];
  const auto begin = static_cast<std::size_t>(chunks.begin[chunk]);
  const std::size_t end = begin + static_cast<std::size_t>(contacts.count[chunk]);
  const bool cohesive = !contacts.cohesion.empty();
  // Apart, so that they stay in registers, for which `add` has to be inlined at each of its calls: called, it
  // takes half as many instructions again.
  std::int64_t overlapping = 0;
  double penetration = 0, penetration_max = 0, deepest = 0, moment[9] = {}, normal_impulse = 0;
  const auto add = [&](std::size_t k, const Vec3& branch, double gap, double smaller_radius)
      __attribute__((always_inline)) {
    // Without a branch: which contacts overlap cannot be predicted.
    const double overlap = std::max(0.0, -gap);
    overlapping += overlap > 0 ? 1 : 0;
    penetration += overlap;
    penetration_max = std::max(penetration_max, overlap);
    // A branch that is hardly ever taken costs less than a division for each contact.
    if (overlap > deepest * smaller_radius) deepest = overlap / smaller_radius;
    const Vec3 r = cohesive ? contact_impulse(contacts, k) : law_impulse(contacts, k);
    for (Eigen::Index c = 0; c < 9; ++c) moment[c] += r[c % 3] * branch[c / 3];
    normal_impulse += r.dot(contact_normal(contacts, k));
  };
  if (chunks.kind[chunk] == ChunkKind::blocks) {
    const std::int32_t w = chunks.wall[chunk];
    const Wall* const wall = w < 0 ? nullptr : &walls[static_cast<std::size_t>(w)];
    for (std::size_t k = begin; k < end; ++k) {
      const Touch touch = touch_of(poses, contacts, k, wall);
      const Vec3& centre = x[static_cast<std::size_t>(contacts.first[k])];
      add(k,
          wall != nullptr ? domain.separation(centre, touch.point)
                          : domain.separation(centre, x[static_cast<std::size_t>(contacts.second[k])]),
          touch.gap, touch.smaller_radius);
    }
  } else if (chunks.wall[chunk] >= 0) {
    const Wall& wall = walls[static_cast<std::size_t>(chunks.wall[chunk])];
    for (std::size_t k = begin; k < end; ++k) {
      const auto i = static_cast<std::size_t>(contacts.first[k]);
      const SurfacePoint point = wall_point(wall, x[i], -1 - contacts.second[k], domain);
      add(k, point.distance * point.normal, point.distance - radius[i], radius[i]);
    }
  } else {
    poses.domain.with_space([&](const auto& space) {
      for (std::size_t k = begin; k < end; ++k) {
        const std::size_t next = std::min(k + ahead, end - 1);
        for (const Slot slot : {contacts.first[next], contacts.second[next]}) {
          __builtin_prefetch(&poses.x[static_cast<std::size_t>(slot)]);
          __builtin_prefetch(&poses.radius[static_cast<std::size_t>(slot)]);
        }
        const auto i = static_cast<std::size_t>(contacts.first[k]),
                   j = static_cast<std::size_t>(contacts.second[k]);
        const double radius_i = poses.radius[i], radius_j = poses.radius[j];
        Vec3 branch = poses.x[i] - poses.x[j];
        space.shorten(branch[0], branch[1], branch[2]);
        add(k, branch, branch.norm() - radius_i - radius_j, std::min(radius_i, radius_j));
      }
    });
  }
  sums.overlapping = overlapping;
  sums.penetration = penetration;
  sums.penetration_max = penetration_max;
  sums.deepest = deepest;
  sums.moment = Eigen::Map<const Eigen::Matrix3d>(moment);
  sums.normal_impulse = normal_impulse;
  return sums;
}

WallSums measure_wall(const Contacts& contacts, const Chunks& chunks, std::size_t chunk, const Poses& poses,
                      const WallMeasure& measure) {
  WallSums sums;
  const auto begin = static_cast<std::size_t>(chunks.begin[chunk]);
  const std::size_t end = begin + static_cast<std::size_t>(contacts.count[chunk]);
  for (std::size_t k = begin; k < end; ++k) {
    if (!contacts.arm.empty()) {
      const Vec3 moment = contact_moment(contacts, k);
      sums.torque += moment;
      if (!contacts.spin.empty()) sums.drift += moment.dot(contacts.spin[k]);
    }
    const Vec3 r = contact_impulse(contacts, k);
    if (r == Vec3::Zero()) continue;
    const auto i = static_cast<std::size_t>(contacts.first[k]);
    const Vec3 arm = chunks.kind[chunk] == ChunkKind::blocks
                         ? contacts.levers[k].arm
                         : Vec3(-poses.radius[i] * contact_normal(contacts, k));
    const Vec3 point = poses.x[i] - measure.half_step * Eigen::Map<const Vec3>(measure.velocity[i].u) + arm;
    sums.torque += poses.domain.separation(point, measure.about).cross(r);
    sums.drift += r.dot(drift_of(contacts, k));
  }
  return sums;
}

std::vector<std::array<Slot, 2>> active_pairs(const Contacts& contacts, const Chunks& chunks) {
  std::vector<std::array<Slot, 2>> pairs;
  for (std::size_t c = 0; c < chunks.size(); ++c) {
    const auto begin = static_cast<std::size_t>(chunks.begin[c]);
    for (std::size_t k = begin; k < begin + static_cast<std::size_t>(contacts.count[c]); ++k) {
      const Slot first = contacts.first[k], second = contacts.second[k];
      if (is_active(contacts, k)) pairs.push_back({first, second >= 0 ? second : first});
    }
  }
  return pairs;
}

}  // namespace talus
