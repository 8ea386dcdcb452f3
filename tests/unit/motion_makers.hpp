#pragma once

/// Motions of walls for tests.

#include "kernels/shapes/prescribed_motion.hpp"

namespace talus::test {

/// About the axis through the point, of any length, at `rate` [rad/s].
inline MotionPart rotation(const Vec3& axis, const Vec3& point, double rate) {
  MotionPart part;
  part.kind = MotionPart::Kind::rotation;
  part.axis = axis.normalized();
  part.point = point;
  part.rate = rate;
  return part;
}

/// [m], [1/s], [rad]
inline MotionPart oscillation(const Vec3& direction, double amplitude, double frequency, double phase = 0) {
  MotionPart part;
  part.kind = MotionPart::Kind::oscillation;
  part.direction = direction.normalized();
  part.amplitude = amplitude;
  part.frequency = frequency;
  part.phase = phase;
  return part;
}

}  // namespace talus::test
