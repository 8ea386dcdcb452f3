#pragma once

#include "kernels/shapes/surface.hpp"

namespace talus::detail {

/// What a sphere meets at `nearest`, the nearest point of a surface without thickness: from whichever side it
/// comes. `side` is the normal for a centre on the surface itself.
inline SurfacePoint facing(const Vec3& centre, const Vec3& nearest, const Vec3& side,
                           std::int32_t feature = 0) {
  const Vec3 d = centre - nearest;
  const double distance = d.norm();
  return {feature, distance, distance > 0 ? Vec3(d / distance) : side};
}

}  // namespace talus::detail
