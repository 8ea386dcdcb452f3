#pragma once

/// Closed surfaces of triangles for tests.

#include <cmath>
#include <cstddef>
#include <vector>

#include "kernels/shapes/shape.hpp"

namespace talus::test {

inline void add_quad(std::vector<Triangle>& triangles, const Vec3& a, const Vec3& b, const Vec3& c,
                     const Vec3& d) {
  triangles.push_back({a, b, c});
  triangles.push_back({a, c, d});
}

/// The box [low, high], each face a grid of n x n squares of two triangles.
inline std::vector<Triangle> box_mesh(const Vec3& low, const Vec3& high, int n = 1) {
  std::vector<Triangle> triangles;
  const Vec3 size = (high - low) / n;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const Eigen::Index u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j)
        for (const bool top : {false, true}) {
          const auto corner = [&](int di, int dj) {
            Vec3 p = low;
            p[axis] = top ? high[axis] : low[axis];
            p[u] = low[u] + (i + di) * size[u];
            p[v] = low[v] + (j + dj) * size[v];
            return p;
          };
          if (top)
            add_quad(triangles, corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1));
          else
            add_quad(triangles, corner(0, 0), corner(0, 1), corner(1, 1), corner(1, 0));
        }
  }
  return triangles;
}

/// A thick funnel about the z axis, open above and below, with `sides` sides: radii within [m] at the bottom
/// (z = 0) and the top (z = height), and the same plus `thickness` without.
inline std::vector<Triangle> funnel_mesh(double bottom, double top, double height, double thickness,
                                         int sides) {
  std::vector<Triangle> triangles;
  const auto at = [&](double radius, double z, int k) {
    const double angle = 2 * 3.14159265358979324 * (k % sides) / sides;
    return Vec3(radius * std::cos(angle), radius * std::sin(angle), z);
  };
  const double radius[4] = {bottom, top, top + thickness, bottom + thickness};
  const double z[4] = {0, height, height, 0};
  for (int k = 0; k < sides; ++k)
    for (std::size_t ring = 0; ring < 4; ++ring) {
      const std::size_t next = (ring + 1) % 4;
      add_quad(triangles, at(radius[ring], z[ring], k), at(radius[next], z[next], k),
               at(radius[next], z[next], k + 1), at(radius[ring], z[ring], k + 1));
    }
  return triangles;
}

/// The same triangles elsewhere.
inline std::vector<Triangle> moved(std::vector<Triangle> triangles, const Vec3& by) {
  for (Triangle& triangle : triangles)
    for (Vec3& p : triangle) p += by;
  return triangles;
}

}  // namespace talus::test
