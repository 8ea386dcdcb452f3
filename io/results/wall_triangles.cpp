#include "io/results/wall_triangles.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <limits>

namespace talus::io {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

struct Plane {
  Vec3 normal;      ///< unit, into what is kept
  double position;  ///< normal . point [m]
  double beyond(const Vec3& x) const { return normal.dot(x) - position; }
};

Bounds nowhere() {
  return {Vec3::Constant(infinity), Vec3::Constant(-infinity)};
}

bool is_somewhere(const Bounds& box) {
  return (box.low.array() <= box.high.array()).all();
}

void widen(Bounds& box, const Vec3& x) {
  box.low = box.low.cwiseMin(x);
  box.high = box.high.cwiseMax(x);
}

/// The part of a convex polygon on the inner side of a plane (Sutherland and Hodgman).
std::vector<Vec3> clipped(const std::vector<Vec3>& polygon, const Plane& plane) {
  std::vector<Vec3> kept;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Vec3 &a = polygon[k], &b = polygon[(k + 1) % polygon.size()];
    const double at_a = plane.beyond(a), at_b = plane.beyond(b);
    if (at_a >= 0) kept.push_back(a);
    if ((at_a >= 0) != (at_b >= 0)) kept.push_back(a + at_a / (at_a - at_b) * (b - a));
  }
  return kept;
}

/// A square in the plane about the foot of `centre`, with edges of four times `size`.
std::vector<Vec3> square(const Plane& plane, const Vec3& centre, double size) {
  Eigen::Index across = 0;
  plane.normal.cwiseAbs().minCoeff(&across);
  const Vec3 a = 2 * size * plane.normal.cross(Vec3::Unit(across)).normalized(), b = plane.normal.cross(a);
  const Vec3 foot = centre - plane.beyond(centre) * plane.normal;
  return {foot - a - b, foot + a - b, foot + a + b, foot - a + b};
}

/// Planes that bound the box, moved out by `margin` [m].
std::vector<Plane> faces(const Bounds& box, double margin) {
  std::vector<Plane> planes;
  for (int axis = 0; axis < 3; ++axis) {
    planes.push_back({Vec3::Unit(axis), box.low[axis] - margin});
    planes.push_back({-Vec3::Unit(axis), -box.high[axis] - margin});
  }
  return planes;
}

}  // namespace

Bounds grain_bounds(const Frame& frame) {
  Bounds box = nowhere();
  for (std::size_t k = 0; k < frame.id.size(); ++k) {
    widen(box, frame.x[k] - Vec3::Constant(frame.radius[k]));
    widen(box, frame.x[k] + Vec3::Constant(frame.radius[k]));
  }
  return box;
}

Bounds grain_bounds(const Frame& part, const graph::Communicator& ranks) {
  const Bounds own = grain_bounds(part);
  std::array<double, 6> ends{-own.low[0], -own.low[1], -own.low[2], own.high[0], own.high[1], own.high[2]};
  ranks.max(ends);
  return {{-ends[0], -ends[1], -ends[2]}, {ends[3], ends[4], ends[5]}};
}

std::vector<std::vector<Triangle>> wall_triangles(std::span<const Wall> walls,
                                                  std::span<const WallReport> now, const Bounds& grains) {
  const std::size_t count = std::min(walls.size(), now.size());
  std::vector<std::vector<Triangle>> all(count);
  Bounds box = grains;
  std::vector<Plane> planes;  // present ones
  for (std::size_t w = 0; w < count; ++w) {
    if (now[w].absent) continue;
    if (walls[w].surface() == nullptr) {
      planes.push_back({now[w].normal.isZero(0) ? walls[w].normal : now[w].normal, now[w].position});
      continue;
    }
    walls[w].surface()->show(all[w]);
    for (Triangle& triangle : all[w])
      for (Vec3& corner : triangle) widen(box, corner = now[w].pose.of(corner));
  }
  if (!is_somewhere(box)) return all;
  const double size = (box.high - box.low).norm(), rounding = 1e-9 * size;
  const Vec3 centre = 0.5 * (box.low + box.high);
  for (const Plane& plane : planes)
    if (const double away = plane.beyond(centre); std::abs(away) < size)
      widen(box, centre - away * plane.normal);
  const double whole = (box.high - box.low).norm();
  std::size_t next = 0;
  for (std::size_t w = 0; w < count; ++w) {
    if (now[w].absent || walls[w].surface() != nullptr) continue;
    const std::size_t own = next++;
    std::vector<Vec3> polygon = square(planes[own], 0.5 * (box.low + box.high), whole);
    for (const Plane& face : faces(box, rounding)) polygon = clipped(polygon, face);
    for (std::size_t other = 0; other < planes.size(); ++other)
      if (other != own) polygon = clipped(polygon, {planes[other].normal, planes[other].position - rounding});
    for (std::size_t k = 2; k < polygon.size(); ++k)
      all[w].push_back({polygon[0], polygon[k - 1], polygon[k]});
  }
  return all;
}

}  // namespace talus::io
