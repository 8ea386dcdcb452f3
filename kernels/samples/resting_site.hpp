#pragma once

/// Geometry of one sphere of radius r at rest on three supports, as r varies. Used by the deposition
/// (kernels/samples/deposit.cpp).
///
/// The centre c of a sphere that touches a base grain (centre c_0, radius R_0) is written p = c - c_0, |p| =
/// R_0 + r. Being clear of any other obstacle is then linear in p and r,
///     p . d <= e_0 + e_1 r,
/// with equality where it touches: for a grain, the difference of the two sphere equations. Two supports
/// beside the base leave a straight line for p, the base cuts it twice; so the site moves along a curve
///     p(r) = a + b r + t sqrt(q_0 + q_1 r + q_2 r^2),
/// and every condition on it (an obstacle is clear, the weight falls between the supports) reads
///     alpha + beta r + gamma sqrt(q(r)) >= 0,
/// whose limits are roots of a quadratic. No iteration, no tolerance but rounding. At a stable site dz/dr >=
/// 1: with e_z = sum lambda_i n_i, lambda_i >= 0 and n_i . dp/dr = 1, dz/dr = sum lambda_i >= |e_z|.

#include <limits>
#include <vector>

#include "kernels/bodies/types.hpp"

namespace talus {

/// Something a sphere may touch or must clear, seen from the base grain: clear if p . d <= e_0 + e_1 r.
struct Obstacle {
  Vec3 d = Vec3::Zero();  ///< to the centre of a grain [m]; minus the inward normal of a wall
  double e0 = 0;
  double e1 = 0;
  bool round = false;  ///< a grain, not a wall
};

/// A grain at `offset` from the base grain [m].
inline Obstacle grain_obstacle(const Vec3& offset, double radius, double base_radius) {
  return {offset, 0.5 * (offset.squaredNorm() + base_radius * base_radius - radius * radius),
          base_radius - radius, true};
}

/// A wall with unit normal `inward`, at `distance` [m] from the centre of the base grain.
inline Obstacle wall_obstacle(const Vec3& inward, double distance) {
  return {-inward, distance, -1, false};
}

/// p(r) = a + b r + t sqrt(q0 + q1 r + q2 r^2), relative to the centre of the base grain.
struct SiteCurve {
  Vec3 a = Vec3::Zero(), b = Vec3::Zero(), t = Vec3::Zero();
  double q0 = 0, q1 = 0, q2 = 0;
  /// Bounds of q, and of its root, for the radii in question (bound_root): most conditions hold, or do not,
  /// for all of these, and need no roots.
  double q_low = -std::numeric_limits<double>::infinity();
  double q_high = std::numeric_limits<double>::infinity();
  double root_low = 0, root_high = std::numeric_limits<double>::infinity();

  double q(double r) const { return q0 + r * (q1 + r * q2); }
  double root(double r) const;
  Vec3 at(double r) const { return a + r * b + root(r) * t; }
};

/// Radii for which something holds: disjoint closed ranges [m], ascending.
struct RadiusRange {
  double low = 0, high = 0;
};
using RadiusRanges = std::vector<RadiusRange>;

/// The curve of the spheres that touch the base grain, `first` and `second`. `t` points upwards, or along
/// first.d x second.d times `side` when that is horizontal (one of them is the floor). False if the three are
/// in line and leave no curve.
bool site_curve(double base_radius, const Obstacle& first, const Obstacle& second, int side,
                SiteCurve& curve);

/// Fills the bounds of the curve for the radii of `range`, which all ranges that are kept of it lie in.
/// Ranges come out the same without it, later.
void bound_root(const RadiusRange& range, SiteCurve& curve);

/// Keeps the radii for which the curve exists.
void keep_real(const SiteCurve& curve, RadiusRanges& ranges);

/// Keeps the radii for which the site clears `obstacle`; overlaps of less than `slack` [m^2] = gap x distance
/// are accepted.
void keep_clear(const SiteCurve& curve, const Obstacle& obstacle, double slack, RadiusRanges& ranges);

/// Keeps the radii for which the weight falls between the base grain, `first` and `second`: e_z is a
/// combination of the three directions of support with coefficients >= -slack. For sites that do not touch
/// the floor, where any site is stable.
void keep_stable(const SiteCurve& curve, const Obstacle& first, const Obstacle& second, double slack,
                 RadiusRanges& ranges);

}  // namespace talus
