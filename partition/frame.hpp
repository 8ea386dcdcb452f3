#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "kernels/bodies/types.hpp"
#include "partition/reduction.hpp"

namespace talus {

/// Integer coordinates of points: 2^21 steps along each axis of a box. All decisions of a partition are taken
/// on these integers, so that a point gets the same subdomain on every rank, bit for bit.
struct IntegerFrame {
  static constexpr int bits = 21;
  static constexpr std::int64_t steps = std::int64_t{1} << bits;

  Vec3 low = Vec3::Zero();      ///< corner of the box [m]
  Vec3 lengths = Vec3::Zero();  ///< edges of the box [m]; 0 where it is flat
  Vec3 scale = Vec3::Zero();    ///< steps per metre; 0 along a flat axis

  /// Coordinates in 0 .. 2^21 - 1. Points outside the box go to its nearest step: grains that leave it after
  /// the partition was made still have a subdomain. `point` must be finite.
  std::array<std::uint32_t, 3> coordinates(const Vec3& point) const;
};

/// The box from `low` to `high` [m]. Throws std::invalid_argument unless both are finite and low <= high.
IntegerFrame make_frame(const Vec3& low, const Vec3& high);

/// The smallest box around the points of all ranks; without any point, a point at the origin.
/// Throws std::invalid_argument, on every rank, if a point is not finite.
IntegerFrame make_frame(std::span<const Vec3> points, const Reduction& reduction);

}  // namespace talus
