#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "kernels/bodies/types.hpp"

namespace talus {

/// Where a sphere may touch a surface.
struct SurfacePoint {
  std::int32_t feature = 0;     ///< which part of the surface: the same one from step to step (warm start)
  double distance = 0;          ///< [m] of the sphere's centre from the surface; below 0 inside a solid
  Vec3 normal = Vec3::UnitZ();  ///< unit, from the surface to the centre
};

/// A corner of a triangle each, counterclockwise as seen from outside the solid [m].
using Triangle = std::array<Vec3, 3>;

/// Axis-parallel box [m].
struct Bounds {
  Vec3 low = Vec3::Zero();
  Vec3 high = Vec3::Zero();
  /// Whether a point lies less than `reach` from the box. False for a point that is not finite.
  bool near(const Vec3& point, double reach) const {
    return (point - point.cwiseMax(low).cwiseMin(high)).squaredNorm() < reach * reach;
  }
};

/// The surface of a wall that is no plane, in its first place (Wall::pose). A sphere may touch it in several
/// points at once: each is a contact of its own, told by its feature. The functions here suit convex bodies
/// and thin plates, which a sphere touches in one point, feature 0; other surfaces override `near` and
/// `collide`.
class Surface {
 public:
  virtual ~Surface() = default;

  virtual Bounds bounds() const = 0;
  /// Appends triangles that show it, for pictures; what is round has corners there.
  virtual void show(std::vector<Triangle>& triangles) const = 0;
  /// Whether it stays what it is, features included, when it turns about this axis (unit) through `point`.
  virtual bool turns_in_itself(const Vec3& axis, const Vec3& point) const {
    static_cast<void>(axis), static_cast<void>(point);
    return false;
  }
  /// The point of a feature for a sphere with this centre, at whatever distance.
  virtual SurfacePoint at(const Vec3& centre, std::int32_t feature) const = 0;
  /// Whether the point of a feature stands beside the nearest one, as two of the three of a circle do, and
  /// goes round with the centre faster than that may move.
  virtual bool goes_round(std::int32_t feature) const {
    static_cast<void>(feature);
    return false;
  }
  /// Appends, ascending, every feature in which a sphere can touch that has its centre within a way s of
  /// `centre`, and reaches `reach` - s: what the broad phase asks for.
  virtual void near(const Vec3& centre, double reach, std::vector<std::int32_t>& features) const {
    if (at(centre, 0).distance < reach) features.push_back(0);
  }
  /// Appends, with ascending features, the points nearer than `reach` [m] in which a sphere touches: what the
  /// narrow phase asks for. `near` finds their features with the same centre and reach, or a larger reach.
  virtual void collide(const Vec3& centre, double reach, std::vector<SurfacePoint>& points) const {
    if (const SurfacePoint point = at(centre, 0); point.distance < reach) points.push_back(point);
  }
  /// How deep a centre lies in what is solid [m]; 0 elsewhere, and for what is thin. Asked where a grain is
  /// to be placed: `collide` of a surface that grains touch from one side says nothing of what lies behind
  /// it.
  virtual double depth(const Vec3& centre) const { return std::max(0.0, -at(centre, 0).distance); }
};

}  // namespace talus
