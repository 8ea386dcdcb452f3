#pragma once

#include <memory>

#include "kernels/shapes/surface.hpp"

namespace talus::detail {

/// A cylinder or a cone, cut off at both ends: the radius goes from `radius[0]` at `end[0]` to `radius[1]` at
/// `end[1]`.
struct Frustum {
  Vec3 end[2];       ///< centres of its ends [m], apart
  double radius[2];  ///< [m], >= 0, not both 0
  /// false: a solid with its two ends closed, which a sphere touches in one point. true: a shell without
  /// thickness, open at both ends, touched from both sides and at its rims. A sphere inside may touch it in a
  /// whole circle, as a ball in a funnel does: three points stand for the circle, the nearest one (feature 0)
  /// and those a third of a turn to either side (1 and 2). A ball on the axis is held by three, and not by
  /// two.
  bool shell;
};

/// Throws std::invalid_argument when both ends are in one place.
std::shared_ptr<const Surface> make_frustum(const Frustum& frustum);

}  // namespace talus::detail
