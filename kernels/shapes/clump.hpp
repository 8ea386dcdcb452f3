#pragma once

/// Clumps: rigid bodies made of spheres ("balls") that touch or overlap.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/bodies/types.hpp"

namespace talus {

struct Ball {
  Vec3 centre = Vec3::Zero();
  double radius = 0;
};

/// The shape of a clump in its principal frame, about its centre of mass, in units of its *radius* R: the
/// smallest one about the centre of mass that holds all balls. Bodies of one shape may differ in size.
struct Clump {
  std::vector<Ball> balls;      ///< at most most_balls
  Vec3 inertia = Vec3::Zero();  ///< principal moments over m R^2
  double volume = 0;            ///< over R^3
  double smallest = 0;          ///< radius of the smallest ball
  double mean_inertia() const { return inertia.mean(); }
};

/// So that the balls of two bodies have one number of 16 bits together.
inline constexpr std::size_t most_balls = 255;

/// A clump as it was described, and where it then stands: x = centre + Q (R p) for a point p of `clump`.
struct PlacedClump {
  Clump clump;
  double radius = 0;           ///< R [m]
  Vec3 centre = Vec3::Zero();  ///< of mass [m]
  std::array<double, 4> orientation{1, 0, 0, 0};
};

/// A clump of balls given in any frame [m], of one density. Where balls overlap the common volume counts with
/// each of them, in mass and inertia alike: exact for balls that touch at most. Throws std::invalid_argument
/// when there is no ball, more than most_balls, or one whose centre or radius makes no sense.
PlacedClump make_clump(std::span<const Ball> balls);

/// How the bodies of a process are shaped and turned.
struct ClumpView {
  std::span<const ShapeNumber> shape = {};                  ///< per slot; empty: all are spheres
  std::span<const std::array<double, 4>> orientation = {};  ///< per slot where shapes are given
  std::span<const Clump> clumps = {};

  bool is_clump(std::size_t slot) const { return !shape.empty() && shape[slot] != 0; }
  /// Of a slot that is a clump.
  const Clump& of(std::size_t slot) const { return clumps[shape[slot] - std::size_t{1}]; }
  std::size_t balls(std::size_t slot) const { return is_clump(slot) ? of(slot).balls.size() : 1; }
};

/// Rotation matrix of a unit quaternion (w, x, y, z).
Mat3 rotation_of(const std::array<double, 4>& q);

/// Ball `number` of the body at a slot with this centre and radius [m]; of a sphere the sphere itself.
Ball ball_of(const ClumpView& view, std::size_t slot, std::size_t number, const Vec3& x, double radius);

}  // namespace talus
