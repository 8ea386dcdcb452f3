#include "kernels/sweeps/cohesion.hpp"

#include <algorithm>

#include "kernels/bodies/index.hpp"
#include "kernels/detection/materials.hpp"
#include "kernels/detection/measures.hpp"
#include "kernels/detection/touch.hpp"

namespace talus {

void find_cohesion(const NarrowPhase& in, const Candidates& candidates, const Chunks& chunks,
                   std::size_t chunk, Contacts& contacts) {
  if (contacts.cohesion.empty()) return;
  constexpr CohesionRule rule;
  const double impulse_time = in.time_step / (1 + in.reflection);
  const MaterialView materials{in.material, in.walls};
  const Poses poses{in.x, in.radius, in.walls, in.clumps, in.domain};
  const Wall* const wall = chunks.wall[chunk] < 0 ? nullptr : &in.walls[at(chunks.wall[chunk])];
  const std::size_t begin = at(chunks.begin[chunk]), end = begin + at(contacts.count[chunk]);
  for (std::size_t k = begin; k < end; ++k) {
    const PairLaw& law = law_at(in.laws, candidates, materials, at(contacts.candidate[k]));
    const Touch touch = touch_of(poses, contacts, k, wall);
    const bool touches = touch.gap <= rule.reach * touch.smaller_radius;
    contacts.cohesion[k] =
        touches ? law.cohesion_of({touch.ball.radius, touch.second_radius}) * impulse_time : 0;
  }
}

void pull_together(const Contacts& contacts, ContactRange range, std::span<Velocity> velocity,
                   WallCopy* wall) {
  if (contacts.cohesion.empty()) return;
  for (std::size_t k = range.begin; k < range.end; ++k) {
    const Vec3 normal = contact_normal(contacts, k), pull = contacts.cohesion[k] * normal;
    Velocity& first = velocity[at(contacts.first[k])];
    Eigen::Map<Vec3> u(first.u);
    u -= first.inv_mass * pull;
    if (wall) {
      Eigen::Map<Vec3> v(wall->velocity);
      v += wall->inv_mass * pull;
    } else {
      Velocity& second = velocity[at(contacts.second[k])];
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
