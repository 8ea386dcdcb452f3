#pragma once

/// When a time step was too long for two bodies.

#include <algorithm>

#include "kernels/bodies/types.hpp"
#include "kernels/shapes/walls.hpp"

namespace talus::detail {

/// Whether the path `way` of one body relative to another is so long that they may have passed one another.
inline bool came_far(const Vec3& way, double small) {
  return !(way.squaredNorm() < 0.25 * small * small);
}

/// How deep bodies are in one another when one has passed, over the smaller radius: those that still come
/// straight at one another, within 60 degrees, whom the contact of this step turns back; and other spheres,
/// as nothing has turned them where they met (0.05: an overlap that a step may make). Other shapes turn
/// meanwhile, so where they were nearest is a guess.
inline constexpr double deep_coming = 0.5, deep_of_spheres = 0.05, deep_of_blocks = 0.5;

/// How a ball is looked for on its way through a surface: so many times for each radius of it, > 1/deep, and
/// so often in all, at most; deep in the surface is what reaches it with this part of the radius, in (0, 1).
struct SurfaceLooks {
  double per_radius = 4, most = 256, deep = 0.5;
};

/// True when two bodies have come to overlap by more than the part `deep_coming`, or `deep` where they no
/// longer come straight, of `small`, the smaller radius, while the vector between their centres changed by
/// `way` to `d`. Their overlap at the beginning does not count. From the middle of one step to that of the
/// next the vector changes by h V-, with V- the velocity at the end of the first.
inline bool passed(const Vec3& d, const Vec3& way, double touching, double small, double deep) {
  if (!came_far(way, small)) return false;
  const Vec3 start = d - way;
  const double nearest = std::clamp(-start.dot(way) / way.squaredNorm(), 0.0, 1.0);
  const bool coming = -d.dot(way) > 0.5 * d.norm() * way.norm();
  const double overlap = touching - (start + nearest * way).norm();
  return overlap - std::max(0.0, touching - start.norm()) > (coming ? deep_coming : deep) * small;
}

/// True when a ball that has moved to `x` by `way`, relative to the wall, was deep in a surface on that way:
/// such a step is too long, and the ball may have passed a thin surface, or into a solid, from where no
/// contact leads out. On a way so long that looks lie far apart one that came near counts, too.
bool passed_surface(const Wall& wall, const Vec3& x, const Vec3& way, double radius,
                    const SurfaceLooks& looks = {});

}  // namespace talus::detail
