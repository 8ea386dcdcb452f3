#pragma once

/// Clumps as bodies: how they are added, and how they turn.

#include <array>

#include "kernels/bodies/bodies.hpp"
#include "kernels/bodies/motion.hpp"
#include "kernels/shapes/clump.hpp"

namespace talus {

/// A clump on its way into the bodies.
struct ClumpBody {
  Vec3 centre = Vec3::Zero();                     ///< of mass [m]
  std::array<double, 4> orientation{1, 0, 0, 0};  ///< of its principal frame
  double radius = 0;                              ///< R [m] > 0
  double density = 0;                             ///< [kg/m^3] > 0
  Vec3 u = Vec3::Zero();                          ///< [m/s]
  Vec3 omega = Vec3::Zero();                      ///< [rad/s]
};

/// What the mass of a clump follows from, without its balls.
struct ClumpMass {
  ShapeNumber number = 0;  ///< 0: a sphere
  double volume = 0;       ///< over R^3
  double inertia = 0;      ///< mean principal moment over m R^2
};
inline ClumpMass mass_of(ShapeNumber number, const Clump& clump) {
  return {number, clump.volume, clump.mean_inertia()};
}

/// Appends a clump that moves with u and does not turn; `omega` is not read. Else as add_clump.
void add_unturning(Bodies& bodies, BodyId id, const ClumpBody& body, const ClumpMass& mass,
                   bool rotates = true);

/// Appends a clump; bodies that were there become spheres with orientations, unless they were told apart
/// before. `number` >= 1 means `clumps[number - 1]`. With `rotates` false its spin mobility is 0.
void add_clump(Bodies& bodies, std::span<const Clump> clumps, ShapeNumber number, BodyId id,
               const ClumpBody& body, bool rotates = true);

/// omega = turning w, where w is what a body's record holds (VelocityOf) [1/m]: S^-1, or 1/R for a sphere.
Mat3 turning_of(const ClumpView& view, std::size_t slot, double radius);

/// Turns clumps freely over `time_step`: their angular momentum stays to rounding, and the direction of their
/// axes is right to second order (midpoint rule on the rotations; Hairer, Lubich and Wanner 2006, IV.8). w
/// belongs to the axes, and changes with them. Spheres are left alone.
void turn_clumps(SlotRange range, Bodies& bodies, std::span<const Clump> clumps, double time_step);

/// Throws std::invalid_argument with the id of a body whose shape `clumps` do not have.
void validate_shapes(const Bodies& bodies, std::span<const Clump> clumps);

}  // namespace talus
