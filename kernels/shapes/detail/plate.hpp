#pragma once

#include "kernels/shapes/surface.hpp"

namespace talus::detail {

/// Whether an axis (unit) through `point` is the line along `direction` (unit) through `centre`, to rounding.
inline bool on_axis(const Vec3& axis, const Vec3& point, const Vec3& direction, const Vec3& centre) {
  constexpr double rounding = 1e-12;
  const Vec3 off = point - centre;
  return (axis - axis.dot(direction) * direction).norm() < rounding &&
         (off - off.dot(direction) * direction).norm() <= rounding * (off.norm() + centre.norm());
}

/// What a sphere meets at `nearest`, the nearest point of a surface without thickness: from whichever side it
/// comes. `side` is the normal for a centre on the surface itself.
inline SurfacePoint facing(const Vec3& centre, const Vec3& nearest, const Vec3& side,
                           std::int32_t feature = 0) {
  const Vec3 d = centre - nearest;
  const double distance = d.norm();
  return {feature, distance, distance > 0 ? Vec3(d / distance) : side};
}

}  // namespace talus::detail
