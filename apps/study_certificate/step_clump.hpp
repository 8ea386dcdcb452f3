#pragma once

/// Clumps in the middle of a step, made anew from their balls and the formulas of docs/theory.md.

#include <array>
#include <span>
#include <vector>

#include "kernels/shapes/clump.hpp"

namespace talus::audit {

using Turn = std::array<double, 4>;  ///< unit quaternion (w, x, y, z)

/// A clump of one size: its inertia over the mass, from its balls alone, which have one density.
struct BallBody {
  std::vector<Ball> balls;       ///< about the centre of mass, in its own axes [m]
  Mat3 gyration = Mat3::Zero();  ///< inertia over mass, in its own axes [m^2]
};
/// `radius` [m] is that of the body.
BallBody sized(const Clump& clump, double radius);

/// A clump with the angular momentum that it has, and the axes of the middle of the step.
struct TurnedClump {
  Mat3 inertia = Mat3::Identity();  ///< [kg m^2]
  /// S = (I/J)^1/2 [m], J a third of the trace of I over R^2: w = S omega, and 1/2 J w^2 is the energy.
  Mat3 lengths = Mat3::Identity();
  double spin_mobility = 0;      ///< 1/J [1/kg]
  Vec3 momentum = Vec3::Zero();  ///< [kg m^2/s] as the step begins
  std::vector<Ball> balls;       ///< from the centre of mass [m]
  Mat3 axes = Mat3::Identity();  ///< from those of the body
  Mat3 gyration = Mat3::Zero();  ///< BallBody
  Vec3 w() const { return lengths * inertia.inverse() * momentum; }
  /// [J] of a turn with that momentum in these axes.
  double energy(const Vec3& of) const { return of.dot(inertia.inverse() * of) / 2; }
};

/// What turns a clump as a step begins.
struct ClumpTurn {
  Turn orientation{1, 0, 0, 0};
  Vec3 omega = Vec3::Zero();  ///< [rad/s]
};
/// Angular momentum [kg m^2/s]; `gyration` as of BallBody.
Vec3 momentum_of(const Mat3& gyration, double mass, const ClumpTurn& turn);

/// Half of a `time_step` [s] later, by the midpoint rule on rotations; the momentum stays.
TurnedClump turned_half(const BallBody& body, double mass, double radius, const ClumpTurn& turn,
                        double time_step);

}  // namespace talus::audit
