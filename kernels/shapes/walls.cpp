#include "kernels/shapes/walls.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace talus {

namespace {
/// Distance to the opposite wall, or -1 when there is none.
double opposite_distance(const std::vector<Wall>& walls, std::size_t index) {
  const Wall& wall = walls[index];
  for (std::size_t k = 0; k < walls.size(); ++k)
    if (k != index && !walls[k].absent && (walls[k].normal + wall.normal).norm() < 1e-12)
      return (walls[k].point - wall.point).dot(wall.normal);
  return -1;
}
}  // namespace

bool Wall::has_drift() const {
  return std::ranges::any_of(motion,
                             [](const MotionPart& part) { return part.surface_only || part.turns(); });
}

SurfacePoint point_at(const Wall& wall, const Vec3& centre, std::int32_t feature) {
  SurfacePoint point = wall.surface()->at(wall.pose.back(centre), feature);
  point.normal = wall.pose.turned(point.normal);
  return point;
}

void collide(const Wall& wall, const Vec3& centre, double reach, std::vector<SurfacePoint>& points) {
  const std::size_t before = points.size();
  wall.surface()->collide(wall.pose.back(centre), reach, points);
  if (!wall.pose.moved) return;
  for (std::size_t k = before; k < points.size(); ++k) points[k].normal = wall.pose.turned(points[k].normal);
}

bool at_seam(std::span<const Wall> walls, std::size_t index, const Vec3& centre, double radius,
             const SurfacePoint& point) {
  constexpr SeamThresholds limits;
  std::vector<SurfacePoint> found;
  const auto reaches = [&](const Wall& wall, const Vec3& from, double reach) {
    if (wall.surface() == nullptr) return wall.normal.dot(from - wall.point) < reach;
    if (!wall.surface()->bounds().near(wall.pose.back(from), reach)) return false;
    found.clear();
    collide(wall, from, reach, found);
    return !found.empty();
  };
  // Seen from the side of the sphere, as surfaces may be touched from one side only.
  const double on = limits.on * radius, look = limits.look * radius;
  const Vec3 touched = centre - point.distance * point.normal;
  const auto comes_nearer = [&](const Wall& wall) {
    return reaches(wall, touched + look * point.normal, look * (1 - limits.nearer));
  };
  // What gives way along the normal does not carry in this step what the other one would.
  const Vec3 own = walls[index].velocity_at(touched);
  const auto gives_way = [&](const Wall& wall) {
    const Vec3 velocity = wall.velocity_at(touched);
    return point.normal.dot(velocity - own) < -limits.still * (velocity.norm() + own.norm());
  };
  for (std::size_t w = 0; w < walls.size(); ++w)
    if (w != index && !walls[w].absent && reaches(walls[w], touched + on * point.normal, 2 * on) &&
        comes_nearer(walls[w]) && !gives_way(walls[w]))
      return !comes_nearer(walls[index]);
  return false;
}

void place(const Wall& first, const Pose& pose, Wall& wall) {
  if (wall.surface() != nullptr) {
    wall.pose = pose;
    return;
  }
  wall.point = pose.of(first.point);
  wall.normal = pose.moved ? Vec3(pose.turned(first.normal).normalized()) : first.normal;
}

double face_area(const std::vector<Wall>& walls, std::size_t index, const Vec3& period) {
  const Wall& wall = walls[index];
  if (wall.area > 0) return wall.area;
  double area = 1;
  int pairs = 0;
  for (std::size_t k = 0; k < walls.size(); ++k) {
    if (walls[k].surface() != nullptr || walls[k].absent ||
        std::abs(walls[k].normal.dot(wall.normal)) > 1e-12)
      continue;
    bool counted = false;  // the opposite wall came first
    for (std::size_t earlier = 0; earlier < k; ++earlier)
      counted |= (walls[earlier].normal + walls[k].normal).norm() < 1e-12;
    const double distance = opposite_distance(walls, k);
    if (counted || distance < 0) continue;
    area *= distance;
    ++pairs;
  }
  for (const Eigen::Index axis : {0, 1, 2})
    if (period[axis] > 0) {
      area *= period[axis];
      ++pairs;
    }
  if (pairs != 2)
    throw std::invalid_argument(
        "wall '" + wall.name +
        "': no two pairs of opposite walls at right angles to it bound its face; give its area [m^2]");
  return area;
}

Vec3 box_lengths(const std::vector<Wall>& walls) {
  Vec3 lengths = Vec3::Zero();
  for (std::size_t k = 0; k < walls.size(); ++k)
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      if (!walls[k].absent && walls[k].normal[axis] > 1 - 1e-12)
        lengths[axis] = std::max(0.0, opposite_distance(walls, k));
  return lengths;
}

double box_volume(const std::vector<Wall>& walls) {
  const bool planes = std::ranges::all_of(walls, [](const Wall& wall) { return wall.surface() == nullptr; });
  return planes ? box_lengths(walls).prod() : 0;
}

}  // namespace talus
