#pragma once

/// Candidates of grains at walls, planes or surfaces alike.

#include <cstddef>
#include <span>
#include <vector>

#include "kernels/detection/chunks.hpp"
#include "kernels/detection/domain.hpp"
#include "kernels/shapes/walls.hpp"

namespace talus {

/// The point of a wall, or of one feature of its surface, that is nearest to a sphere with its centre at x.
inline SurfacePoint wall_point(const Wall& wall, const Vec3& x, std::int32_t feature, const Domain& domain) {
  if (wall.surface() != nullptr) return point_at(wall, x, feature);
  return {0, wall.normal.dot(domain.separation(x, wall.point)), wall.normal};
}

/// Whether a sphere overlaps a wall that is there, or lies behind a plane or deep in a solid.
inline bool meets_wall(const Wall& wall, const Vec3& x, double radius, const Domain& domain = {}) {
  if (wall.absent) return false;
  if (wall.surface() == nullptr) return wall_point(wall, x, 0, domain).distance < radius;
  std::vector<SurfacePoint> points;
  collide(wall, x, radius, points);
  return !points.empty() || wall.surface()->depth(wall.pose.back(x)) > 0;
}

/// Order by (wall, body, feature).
inline bool before(const WallPair& a, const WallPair& b) {
  if (a.wall != b.wall) return a.wall < b.wall;
  return a.body != b.body ? a.body < b.body : a.feature < b.feature;
}

/// Whether pair k > 0 stands in another layer than the one before it, in pairs sorted by (wall, layer, body).
inline bool begins_layer(std::span<const WallPair> pairs, std::size_t k) {
  return pairs[k].wall != pairs[k - 1].wall || pairs[k].body <= pairs[k - 1].body;
}

/// The places of the pairs in the order of (wall, layer, body): a pair with l pairs of the same wall and body
/// and lower features is of layer l.
std::vector<std::size_t> layered_order(std::span<const WallPair> pairs);

/// The candidates at walls, in that order: bodies whose centre x [m] is nearer to a wall than their `reach`
/// plus the wall's `margin` [m]. A wall that is absent has none.
std::vector<WallPair> find_wall_pairs(std::span<const Vec3> x, std::span<const double> reach,
                                      std::span<const Wall> walls, std::span<const double> margin,
                                      const Domain& domain = {});

}  // namespace talus
