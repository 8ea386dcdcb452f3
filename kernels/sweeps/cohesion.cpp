#include "kernels/sweeps/cohesion.hpp"

#include <algorithm>

#include "kernels/detection/materials.hpp"
#include "kernels/detection/measures.hpp"
#include "kernels/detection/touch.hpp"
#include "kernels/detection/wall_pairs.hpp"

namespace talus {

namespace {

std::size_t index(std::int32_t k) {
  return static_cast<std::size_t>(k);
}

struct Opening {
  double gap, smaller_radius;  ///< [m]
};

Opening opening_of(const NarrowPhase& in, const Chunks& chunks, std::size_t chunk, const Contacts& contacts,
                   std::size_t k) {
  if (chunks.kind[chunk] == ChunkKind::blocks) {
    const Wall* const wall = chunks.wall[chunk] < 0 ? nullptr : &in.walls[index(chunks.wall[chunk])];
    const Touch touch = touch_of({in.x, in.radius, in.walls, in.clumps, in.domain}, contacts, k, wall);
    return {touch.gap, touch.radius};
  }
  const std::size_t i = index(contacts.first[k]);
  const double radius = in.radius[i];
  if (chunks.wall[chunk] >= 0) {
    const SurfacePoint point =
        wall_point(in.walls[index(chunks.wall[chunk])], in.x[i], -1 - contacts.second[k], in.domain);
    return {point.distance - radius, radius};
  }
  const std::size_t j = index(contacts.second[k]);
  return {in.domain.separation(in.x[i], in.x[j]).norm() - radius - in.radius[j],
          std::min(radius, in.radius[j])};
}

}  // namespace

void find_cohesion(const NarrowPhase& in, const Candidates& candidates, const Chunks& chunks,
                   std::size_t chunk, Contacts& contacts) {
  if (contacts.cohesion.empty()) return;
  constexpr CohesionRule rule;
  const MaterialView materials{in.material, in.walls};
  const std::size_t begin = index(chunks.begin[chunk]), end = begin + index(contacts.count[chunk]);
  for (std::size_t k = begin; k < end; ++k) {
    const double c = law_at(in.laws, candidates, materials, index(contacts.candidate[k])).cohesion;
    const Opening opening = opening_of(in, chunks, chunk, contacts, k);
    contacts.cohesion[k] = opening.gap <= rule.reach * opening.smaller_radius ? c * in.time_step : 0;
  }
}

void pull_together(const Contacts& contacts, ContactRange range, std::span<Velocity> velocity,
                   WallCopy* wall) {
  if (contacts.cohesion.empty()) return;
  for (std::size_t k = range.begin; k < range.end; ++k) {
    const Vec3 normal = contact_normal(contacts, k), pull = contacts.cohesion[k] * normal;
    Velocity& first = velocity[index(contacts.first[k])];
    Eigen::Map<Vec3> u(first.u);
    u -= first.inv_mass * pull;
    if (wall) {
      Eigen::Map<Vec3> v(wall->velocity);
      v += wall->inv_mass * pull;
    } else {
      Velocity& second = velocity[index(contacts.second[k])];
      Eigen::Map<Vec3> v(second.u);
      v += second.inv_mass * pull;
    }
  }
}

Vec3 sum_of_cohesion(const Contacts& contacts, ContactRange range) {
  Vec3 sum = Vec3::Zero();
  if (contacts.cohesion.empty()) return sum;
  for (std::size_t k = range.begin; k < range.end; ++k)
    sum += contacts.cohesion[k] * contact_normal(contacts, k);
  return sum;
}

}  // namespace talus
