#include "kernels/detection/detail/passing.hpp"

#include <cmath>
#include <vector>

namespace talus::detail {

bool passed_surface(const Wall& wall, const Vec3& x, const Vec3& way, double radius,
                    const SurfaceLooks& looks) {
  if (!came_far(way, radius)) return false;
  std::vector<SurfacePoint> points;
  const double length = way.norm(),
               count = std::ceil(std::min(looks.most, looks.per_radius * length / radius));
  // Where looks lie far apart they reach to one another, and to where the way began.
  const double apart = length / count, deep = std::max(looks.deep * radius, apart);
  const double last = deep == apart ? count : count - 1;
  for (double look = 0; look <= last && points.empty(); ++look)
    collide(wall, x - look / count * way, deep, points);
  return !points.empty();
}

}  // namespace talus::detail
