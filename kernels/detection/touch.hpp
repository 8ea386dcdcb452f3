#pragma once

/// How two bodies, or a body and a wall, touch through given balls (kernels/shapes/clump.hpp); a sphere is
/// its only ball. For code where it costs no time to ask each contact for its kind.

#include <span>

#include "kernels/detection/domain.hpp"
#include "kernels/detection/measures.hpp"
#include "kernels/shapes/clump.hpp"

namespace talus {

/// Balls of a pair as one number: that of the first body x 256 + that of the second.
using BallNumbers = std::uint16_t;
inline BallNumbers ball_numbers(std::size_t first, std::size_t second) {
  return static_cast<BallNumbers>(256 * first + second);
}

struct Touch {
  Vec3 normal = Vec3::UnitZ();     ///< unit, to the first body
  Ball ball;                       ///< of the first body [m]
  double gap = 0;                  ///< [m]
  double second_radius = 0;        ///< of the other ball; infinite at a wall [m]
  double smaller_radius = 0;       ///< of both balls [m]
  Vec3 point = Vec3::Zero();       ///< halfway across the gap; at a wall on the ball [m]
  Vec3 separation = Vec3::Zero();  ///< of the balls' centres; at a wall of the ball's from the wall [m]
};

/// Touch of two bodies by their balls `numbers`.
Touch touch_bodies(const Poses& poses, Slot first, Slot second, BallNumbers numbers);

/// Touch of a body and a wall. The feature of a clump is that of the surface x its number of balls + the
/// ball.
Touch touch_wall(const Poses& poses, const Wall& wall, Slot body, std::int32_t feature);

/// Touch of contact k, of spheres or blocks, at `wall`, or between bodies where that is null.
Touch touch_of(const Poses& poses, const Contacts& contacts, std::size_t k, const Wall* wall);

/// Branch vector of the same contact [m]: to the centre of the first body from that of the second, at a wall
/// from the point of contact; of a sphere from the nearest point of the wall.
Vec3 branch_of(const Poses& poses, const Contacts& contacts, std::size_t k, const Wall* wall);

}  // namespace talus
