#include "partition/frame.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>

namespace talus {

std::array<std::uint32_t, 3> IntegerFrame::coordinates(const Vec3& point) const {
  std::array<std::uint32_t, 3> q;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto axis = static_cast<Eigen::Index>(k);
    const double step = (point[axis] - low[axis]) * scale[axis];
    q[k] = static_cast<std::uint32_t>(std::clamp(step, 0.0, static_cast<double>(steps - 1)));
  }
  return q;
}

IntegerFrame make_frame(const Vec3& low, const Vec3& high) {
  IntegerFrame frame;
  frame.low = low;
  frame.lengths = high - low;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const double length = frame.lengths[axis];
    if (!std::isfinite(low[axis]) || !std::isfinite(high[axis]) || !(length >= 0)) {
      std::ostringstream text;
      text << "partition: the box around the sample goes from " << low[axis] << " to " << high[axis]
           << " m along axis " << axis << "; a centre is not finite, or the bounds are exchanged";
      throw std::invalid_argument(text.str());
    }
    // Two points a rounding apart, or one point: flat, and no overflow of the quotient.
    const double scale = static_cast<double>(IntegerFrame::steps) / length;
    frame.scale[axis] = std::isfinite(scale) ? scale : 0.0;
  }
  return frame;
}

IntegerFrame make_frame(std::span<const Vec3> points, const Reduction& reduction) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  // -min and max of each axis, and a flag: a maximum over ranks would lose a NaN.
  std::array<double, 7> bounds;
  bounds.fill(-infinity);
  bounds[6] = 0;
  for (const Vec3& point : points)
    for (std::size_t k = 0; k < 3; ++k) {
      const double value = point[static_cast<Eigen::Index>(k)];
      if (!std::isfinite(value)) bounds[6] = 1;
      bounds[k] = std::max(bounds[k], -value);
      bounds[3 + k] = std::max(bounds[3 + k], value);
    }
  reduction.max(bounds);
  if (bounds[6] > 0)
    throw std::invalid_argument(
        "partition: the midpoint of a candidate is not finite; a body has left the finite numbers");
  if (bounds[0] == -infinity) return make_frame(Vec3::Zero(), Vec3::Zero());
  return make_frame({-bounds[0], -bounds[1], -bounds[2]}, {bounds[3], bounds[4], bounds[5]});
}

}  // namespace talus
