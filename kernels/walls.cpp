#include "kernels/walls.hpp"

#include <cmath>
#include <stdexcept>

namespace talus {

namespace {
/// Distance to the opposite wall, or -1 when there is none.
double opposite_distance(const std::vector<Wall>& walls, std::size_t index) {
  const Wall& wall = walls[index];
  for (std::size_t k = 0; k < walls.size(); ++k)
    if (k != index && (walls[k].normal + wall.normal).norm() < 1e-12)
      return (walls[k].point - wall.point).dot(wall.normal);
  return -1;
}
}  // namespace

double face_area(const std::vector<Wall>& walls, std::size_t index) {
  const Wall& wall = walls[index];
  if (wall.area > 0) return wall.area;
  double area = 1;
  int pairs = 0;
  for (std::size_t k = 0; k < walls.size(); ++k) {
    if (std::abs(walls[k].normal.dot(wall.normal)) > 1e-12) continue;
    bool counted = false;  // the opposite wall came first
    for (std::size_t earlier = 0; earlier < k; ++earlier)
      counted |= (walls[earlier].normal + walls[k].normal).norm() < 1e-12;
    const double distance = opposite_distance(walls, k);
    if (counted || distance < 0) continue;
    area *= distance;
    ++pairs;
  }
  if (pairs != 2)
    throw std::invalid_argument("wall '" + wall.name +
                                "': no two pairs of opposite walls at right angles to it bound its face; give its area [m^2]");
  return area;
}

double box_volume(const std::vector<Wall>& walls) {
  for (std::size_t k = 0; k < walls.size(); ++k) {
    const double depth = opposite_distance(walls, k);
    if (depth < 0) continue;
    std::vector<Wall> faces = walls;
    faces[k].area = 0;
    try {
      return depth * face_area(faces, k);
    } catch (const std::invalid_argument&) {
      return 0;
    }
  }
  return 0;
}

}  // namespace talus
