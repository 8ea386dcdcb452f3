#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <vector>

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

/// Corners of the polygon that stands for a circle in pictures [m]; axis and side are unit, at right angles.
inline std::vector<Vec3> circle_corners(const Vec3& centre, const Vec3& axis, const Vec3& side,
                                        double radius) {
  constexpr int corners = 64;
  std::vector<Vec3> circle;
  for (int k = 0; k < corners; ++k) {
    const double angle = 2 * std::numbers::pi * k / corners;
    circle.push_back(centre + radius * (std::cos(angle) * side + std::sin(angle) * axis.cross(side)));
  }
  return circle;
}

/// Unit, at right angles to `axis`.
inline Vec3 any_side(const Vec3& axis) {
  Eigen::Index across = 0;
  axis.cwiseAbs().minCoeff(&across);
  return axis.cross(Vec3::Unit(across)).normalized();
}

/// Appends the triangles of a disc with these corners.
inline void show_disc(const Vec3& centre, const std::vector<Vec3>& corners,
                      std::vector<Triangle>& triangles) {
  for (std::size_t k = 0; k < corners.size(); ++k)
    triangles.push_back({centre, corners[k], corners[(k + 1) % corners.size()]});
}

}  // namespace talus::detail
