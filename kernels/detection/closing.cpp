#include "kernels/detection/closing.hpp"

#include <algorithm>

#include "kernels/detection/touch.hpp"

namespace talus {

namespace {

std::size_t index(Slot slot) {
  return static_cast<std::size_t>(slot);
}

Vec3 velocity_of(const Bodies& bodies, Slot slot) {
  return Eigen::Map<const Vec3>(bodies.velocity[index(slot)].u);
}

/// Largest speed of a ball of the body relative to its centre of mass [m/s]: 0 for spheres.
double spin_of(const Bodies& bodies, Slot slot) {
  if (bodies.shape.empty() || bodies.shape[index(slot)] == 0) return 0;
  return Eigen::Map<const Vec3>(bodies.velocity[index(slot)].w).norm();
}

}  // namespace

double closing_rate(const Candidates& candidates, const Bodies& bodies, const Poses& poses, double near) {
  double rate = 0;
  const auto consider = [&](double speed, double gap) { rate = std::max(rate, speed / std::max(gap, near)); };
  for (std::size_t k = 0; k < candidates.grain_pairs.size(); ++k) {
    const auto [first, second] = candidates.grain_pairs[k];
    const BallNumbers balls = candidates.balls.empty() ? BallNumbers{0} : candidates.balls[k];
    const Touch touch = touch_bodies(poses, first, second, balls);
    const Vec3 image = poses.domain.image_velocity(bodies.x[index(first)], bodies.x[index(second)]);
    const double approach =
        -touch.normal.dot(velocity_of(bodies, first) - velocity_of(bodies, second) - image);
    consider(approach + spin_of(bodies, first) + spin_of(bodies, second), touch.gap);
  }
  for (const WallPair& pair : candidates.wall_pairs) {
    const Wall& wall = poses.walls[index(pair.wall)];
    const Touch touch = touch_wall(poses, wall, pair.body, pair.feature);
    const Vec3 u = velocity_of(bodies, pair.body) - wall.velocity_at(touch.ball.centre);
    const double speed = wall.surface() == nullptr ? -touch.normal.dot(u) : u.norm();
    consider(speed + spin_of(bodies, pair.body), touch.gap);
  }
  return rate;
}

}  // namespace talus
