#pragma once

/// How a wall moves that nothing can hold up: a sum of simple motions. Where it is at a time follows from
/// that time alone, so that nothing drifts and rounding does not add up.

#include <array>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "kernels/bodies/types.hpp"

namespace talus {

/// Where a rigid surface stands: a point X of its first place is at turn X + shift.
struct Pose {
  Mat3 turn = Mat3::Identity();
  Vec3 shift = Vec3::Zero();  ///< [m]
  bool moved = false;         ///< false: it is where it was at first, to the bit

  Vec3 of(const Vec3& first) const { return moved ? Vec3(turn * first + shift) : first; }
  Vec3 back(const Vec3& now) const { return moved ? Vec3(turn.transpose() * (now - shift)) : now; }
  Vec3 turned(const Vec3& direction) const { return moved ? Vec3(turn * direction) : direction; }
};

/// A motion by points of a curve, from time 0 on. Displacements are linear between rows, or where velocities
/// are given, these are.
struct MotionTable {
  std::vector<double> t;       ///< [s] ascending, from 0
  std::vector<Vec3> shift;     ///< per row: displacement since the first one [m]; or empty
  std::vector<Vec3> velocity;  ///< per row [m/s], where these are given; `shift` is their integral
  std::vector<double> angle;   ///< per row [rad]; or empty

  double end() const { return t.back(); }
};

/// Fills `shift` from `velocity`.
void integrate(MotionTable& table);

/// One motion among those that a wall makes at once.
struct MotionPart {
  enum class Kind {
    velocity,     ///< along a line, with one velocity
    rotation,     ///< about a line in space, with one rate
    oscillation,  ///< along a line, as a sine of time
    table,        ///< by a table: displacement or velocity, angle, or both
  };
  Kind kind = Kind::velocity;
  Vec3 velocity = Vec3::Zero();   ///< [m/s]
  Vec3 axis = Vec3::Zero();       ///< of rotation and table: unit, or 0
  Vec3 point = Vec3::Zero();      ///< of that axis [m]
  double rate = 0;                ///< of rotation [rad/s]
  Vec3 direction = Vec3::Zero();  ///< of oscillation, unit
  double amplitude = 0;           ///< of oscillation [m]
  double frequency = 0;           ///< of oscillation [1/s]
  double phase = 0;       ///< of oscillation [rad]: displacement A (sin(2 pi f t + phase) - sin phase)
  std::string file = {};  ///< of the table
  std::shared_ptr<const MotionTable> table = {};
  bool surface_only = false;     ///< the surface stays; its material moves along it
  std::string from_stage = {};   ///< begins with this stage; empty: with the run
  std::string until_stage = {};  ///< ends when this stage begins; empty: never
  /// Time of the run between which it moves [s], as far as stages have begun; before and after it rests where
  /// it is.
  double begin = 0, end = std::numeric_limits<double>::infinity();

  bool turns() const { return kind == Kind::rotation || (table && !table->angle.empty()); }
};

/// About an axis of any length through a point [m], at `rate` [rad/s].
MotionPart rotation_part(const Vec3& axis, const Vec3& point, double rate);
/// Along a direction of any length, by `amplitude` [m], with `frequency` [1/s] and `phase` [rad].
MotionPart oscillation_part(const Vec3& direction, double amplitude, double frequency, double phase = 0);

/// What a motion has done since it began.
struct Displacement {
  Vec3 shift = Vec3::Zero();  ///< [m]
  double angle = 0;           ///< about the axis [rad]
};
Displacement displacement(const MotionPart& part, double time);
/// The same from `time` to `time + h`, without the rounding of a difference where it can be had.
Displacement advance(const MotionPart& part, double time, double h);

/// Where the parts, all but those of the surface only, bring a wall: rotations about their axes as they are
/// in space, one after the other, and then all displacements.
Pose pose_at(std::span<const MotionPart> parts, double time);

/// Rigid velocity: that of a point c is `velocity` + `omega` x (c - `pivot`).
struct RigidVelocity {
  Vec3 velocity = Vec3::Zero();  ///< of the pivot [m/s]
  Vec3 omega = Vec3::Zero();     ///< [rad/s]
  Vec3 pivot = Vec3::Zero();     ///< [m]
  Vec3 at(const Vec3& c) const;
};

/// The one that brings a wall, within `h`, from where it is at `time` to where it is at time + h: the twist
/// whose exponential is that displacement.
RigidVelocity mean_velocity(std::span<const MotionPart> parts, double time, double h);

/// Mean velocity of the material in the surface against the surface, likewise, about the same pivot.
RigidVelocity mean_surface_velocity(std::span<const MotionPart> parts, double time, double h,
                                    const Vec3& pivot);

/// Bound on the acceleration of oscillations [m/s^2].
double largest_acceleration(std::span<const MotionPart> parts);
/// The shortest period of an oscillation [s]; infinity where there is none.
double shortest_period(std::span<const MotionPart> parts);

}  // namespace talus
