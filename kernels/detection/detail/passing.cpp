#include "kernels/detection/detail/passing.hpp"

#include <cmath>
#include <vector>

namespace talus::detail {

bool passed_surface(const Wall& wall, const Vec3& x, const Vec3& way, double radius) {
  if (!came_far(way, radius)) return false;
  std::vector<SurfacePoint> points;
  constexpr double most = 256;  // looks
  const double length = way.norm(), looks = std::ceil(std::min(most, 4 * length / radius));
  // Where looks lie far apart they reach to one another, and to where the way began.
  const double deep = std::max(0.5 * radius, length / looks), last = deep > 0.5 * radius ? looks : looks - 1;
  for (double look = 0; look <= last && points.empty(); ++look)
    collide(wall, x - look / looks * way, deep, points);
  return !points.empty();
}

}  // namespace talus::detail
