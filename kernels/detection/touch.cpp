#include "kernels/detection/touch.hpp"

#include <algorithm>
#include <limits>

#include "kernels/detection/wall_pairs.hpp"

namespace talus {

namespace {

Ball ball_at(const Poses& poses, Slot slot, std::size_t number) {
  const auto s = static_cast<std::size_t>(slot);
  return ball_of(poses.clumps, s, number, poses.x[s], poses.radius[s]);
}

}  // namespace

Touch touch_bodies(const Poses& poses, Slot first, Slot second, BallNumbers numbers) {
  const Ball a = ball_at(poses, first, numbers / 256), b = ball_at(poses, second, numbers % 256);
  Touch touch;
  touch.separation = poses.domain.separation(a.centre, b.centre);
  const double distance = touch.separation.norm();
  if (distance > 0) touch.normal = touch.separation / distance;
  touch.gap = distance - a.radius - b.radius;
  touch.ball = a;
  touch.second_radius = b.radius;
  touch.smaller_radius = std::min(a.radius, b.radius);
  touch.point = a.centre - (a.radius + 0.5 * touch.gap) * touch.normal;
  return touch;
}

Touch touch_wall(const Poses& poses, const Wall& wall, Slot body, std::int32_t feature) {
  const auto balls = static_cast<std::int32_t>(poses.clumps.balls(static_cast<std::size_t>(body)));
  const Ball ball = ball_at(poses, body, static_cast<std::size_t>(feature % balls));
  const SurfacePoint at = wall_point(wall, ball.centre, feature / balls, poses.domain);
  Touch touch;
  touch.normal = at.normal;
  touch.gap = at.distance - ball.radius;
  touch.ball = ball;
  touch.second_radius = std::numeric_limits<double>::infinity();
  touch.smaller_radius = ball.radius;
  touch.point = ball.centre - ball.radius * at.normal;
  touch.separation = at.distance * at.normal;
  return touch;
}

Touch touch_of(const Poses& poses, const Contacts& contacts, std::size_t k, const Wall* wall) {
  if (wall != nullptr) return touch_wall(poses, *wall, contacts.first[k], -1 - contacts.second[k]);
  const BallNumbers numbers = contacts.balls.empty() ? BallNumbers{0} : contacts.balls[k];
  return touch_bodies(poses, contacts.first[k], contacts.second[k], numbers);
}

Vec3 branch_of(const Poses& poses, const Contacts& contacts, std::size_t k, const Wall* wall) {
  const auto i = static_cast<std::size_t>(contacts.first[k]);
  if (wall == nullptr)
    return poses.domain.separation(poses.x[i], poses.x[static_cast<std::size_t>(contacts.second[k])]);
  const Touch touch = touch_of(poses, contacts, k, wall);
  return poses.clumps.is_clump(i) ? poses.domain.separation(poses.x[i], touch.point) : touch.separation;
}

}  // namespace talus
