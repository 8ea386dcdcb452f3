#include "apps/study_certificate/step_walls.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "apps/study_certificate/step_gaps.hpp"
#include "apps/study_certificate/touch_shapes.hpp"

namespace talus::audit {

namespace {

/// What a part of a motion has done at a time of the run.
struct Done {
  Vec3 shift = Vec3::Zero();  ///< [m]
  double angle = 0;           ///< [rad]
};

/// By the rows of a table, t since the part began. Behind its end the last slope goes on.
Done read_rows(const MotionTable& table, double t) {
  Done done;
  for (std::size_t k = 0; k + 1 < table.t.size(); ++k) {
    const bool last = k + 2 == table.t.size();
    const double span = table.t[k + 1] - table.t[k];
    const double part = last ? (t - table.t[k]) / span : std::clamp((t - table.t[k]) / span, 0.0, 1.0);
    if (part <= 0) break;
    if (!table.velocity.empty())
      done.shift +=
          span * (part * table.velocity[k] + part * part / 2 * (table.velocity[k + 1] - table.velocity[k]));
    else if (!table.shift.empty())
      done.shift += part * (table.shift[k + 1] - table.shift[k]);
    if (!table.angle.empty()) done.angle += part * (table.angle[k + 1] - table.angle[k]);
  }
  if (!table.angle.empty()) done.angle += table.angle.front();
  return done;
}

Done done_by(const MotionPart& part, double time) {
  const double t = std::max(0.0, std::min(time, part.end) - part.begin);
  Done done;
  switch (part.kind) {
    case MotionPart::Kind::velocity:
      done.shift = t * part.velocity;
      break;
    case MotionPart::Kind::rotation:
      done.angle = t * part.rate;
      break;
    case MotionPart::Kind::oscillation:
      done.shift = part.amplitude *
                   (std::sin(2 * std::numbers::pi * part.frequency * t + part.phase) - std::sin(part.phase)) *
                   part.direction;
      break;
    case MotionPart::Kind::table:
      done = read_rows(*part.table, t);
      break;
  }
  return done;
}

/// Turns about lines in space, one after the other, and behind them all shifts.
Placement placed_by(const std::vector<MotionPart>& parts, double time) {
  Placement place;
  Vec3 shift = Vec3::Zero();
  for (const MotionPart& part : parts) {
    if (part.surface_only) continue;
    const Done done = done_by(part, time);
    shift += done.shift;
    if (!part.turns()) continue;
    const Mat3 turn = Eigen::AngleAxisd(done.angle, part.axis).toRotationMatrix();
    place = {turn * place.turn, turn * (place.shift - part.point) + part.point};
  }
  place.shift += shift;
  return place;
}

Mat3 cross_matrix(const Vec3& v) {
  Mat3 cross;
  cross << 0, -v[2], v[1], v[2], 0, -v[0], -v[1], v[0], 0;
  return cross;
}

/// The one that carries a body from one place to another within h: the logarithm of the way between them.
Twist twist_between(const Placement& from, const Placement& to, double h) {
  const Mat3 turn = to.turn * from.turn.transpose();
  const Vec3 shift = to.shift - turn * from.shift;
  const Eigen::AngleAxisd rotation(turn);
  const double angle = rotation.angle(), a2 = angle * angle;
  const Vec3 phi = angle * rotation.axis();
  // exp: shift = (1 + a [phi] + b [phi]^2) origin; series where the closed forms would cancel.
  const bool small = angle < 1e-2;
  const double a = small ? 0.5 - a2 / 24 + a2 * a2 / 720 : (1 - std::cos(angle)) / a2;
  const double b = small ? 1.0 / 6 - a2 / 120 + a2 * a2 / 5040 : (angle - std::sin(angle)) / (a2 * angle);
  const Mat3 cross = cross_matrix(phi);
  const Mat3 exponential = Mat3::Identity() + a * cross + b * cross * cross;
  return {exponential.inverse() * shift / h, phi / h};
}

}  // namespace

StepWall::StepWall(const Wall& wall, double time, double h) : wall_(wall), time_(time), h_(h) {
  if (wall.shape.name == "mesh") wall.surface()->show(triangles_);
  if (!moves()) return;
  const Placement middle = placed(h / 2);
  rigid_ = twist_between(middle, placed(3 * h / 2), h);
  for (const MotionPart& part : wall.motion) {
    if (!part.surface_only) continue;
    const Done then = done_by(part, time + h / 2), done = done_by(part, time + 3 * h / 2);
    along_.origin += middle.turn * (done.shift - then.shift) / h;
    if (!part.turns()) continue;
    const Vec3 omega = (done.angle - then.angle) / h * (middle.turn * part.axis);
    along_.origin -= omega.cross(middle.of(part.point));
    along_.omega += omega;
  }
}

Placement StepWall::placed(double later) const {
  if (moves()) return placed_by(wall_.motion, time_ + later);
  return {Mat3::Identity(), later * wall_.velocity};
}

std::vector<WallTouch> StepWall::touches(const Vec3& centre, double reach, const Placement& where) const {
  std::vector<WallTouch> all;
  if (wall_.surface() == nullptr) {
    // Its point and normal have come along with its motion.
    const Placement now = placed(0);
    const Vec3 normal = where.turn * (now.turn.transpose() * wall_.normal);
    all.push_back({normal.dot(centre - where.of(now.back(wall_.point))), normal});
  } else {
    all = touches_of(wall_.shape, triangles_, where.back(centre), reach);
    for (WallTouch& touch : all) touch.normal = where.turn * touch.normal;
  }
  std::erase_if(all, [&](const WallTouch& touch) { return !(touch.distance < reach); });
  return all;
}

Vec3 StepWall::material_velocity(const Vec3& point, const Vec3& normal, const Vec3& u) const {
  const auto in_plane = [&](const Vec3& v) { return Vec3(v - v.dot(normal) * normal); };
  const Vec3 onward = in_plane(u) + rigid_.at(point).dot(normal) * normal, there = point + h_ / 2 * onward;
  const Vec3 turned = rigid_.at(there) - rigid_.at(point);
  return rigid_.at(point) + in_plane(turned + along_.at(there));
}

double StepWall::speed_near(const Vec3& centre, double radius) const {
  return rigid_.at(centre).norm() + along_.at(centre).norm() +
         radius * (rigid_.omega.norm() + along_.omega.norm());
}

double StepWall::overlap(const Vec3& centre, double radius, const Placement& where) const {
  double deepest = 0;
  for (const WallTouch& touch : touches(centre, radius, where))
    deepest = std::max(deepest, radius - touch.distance);
  return deepest;
}

namespace {

/// Where two walls count as one at a place, as parts of the sphere's radius.
struct Seam {
  double none = 1e-6;   ///< a distance that counts as none
  double step = 0.1;    ///< so far before the place it is asked who is nearer
  double equal = 1e-9;  ///< distances there, and velocities, that differ by less are equal
};

}  // namespace

bool stands_on_another(std::span<const StepWall> walls, std::span<const Placement> placed, std::size_t w,
                       const Vec3& centre, double radius, const WallTouch& touch) {
  if (walls[w].plane()) return false;
  const Vec3 point = centre - touch.distance * touch.normal;
  constexpr Seam seam;
  const double step = seam.step * radius, none = seam.none * radius;
  const auto nearest = [&](std::size_t wall, double away) {
    double least = INFINITY;
    for (const WallTouch& here : walls[wall].touches(point + away * touch.normal, 2 * away, placed[wall]))
      least = std::min(least, here.distance);
    return least;
  };
  const double nearer = step * (1 - seam.equal);
  // A wall that leaves the other behind does not hold the sphere in its place.
  const auto leaves = [&](std::size_t wall) {
    const Vec3 of_wall = walls[wall].velocity_at(point), of_w = walls[w].velocity_at(point);
    return (of_wall - of_w).dot(touch.normal) < -seam.equal * (of_wall.norm() + of_w.norm());
  };
  for (std::size_t other = 0; other < walls.size(); ++other)
    if (other != w && walls[other].there() && nearest(other, none) < 2 * none &&
        nearest(other, step) < nearer && !leaves(other))
      return nearest(w, step) >= nearer;
  return false;
}

namespace {

/// How a touch is followed along a way.
struct Following {
  int parts = 64;                ///< of the way; from one to the next a place moves little
  double bends = turned_normal;  ///< a normal that has turned by less at the end is the same
  double exact = 1e-12;          ///< part of the way to which a place on it is found
  double straight = 1e-6;        ///< a face's normal turns by less while an edge's would turn by `bends`
};

/// A touch of a sphere on its way, s in [0, 1].
struct Followed {
  double s = 0;
  WallTouch touch;
  Vec3 place = Vec3::Zero();  ///< on the wall [m]
};

/// How a wall falls back behind the plane in which it is seen: not at all, as a hollow that comes nearer, as
/// a corner, or as what bends about more than the sphere's distance from it, which keeps its normal.
enum class FallsBack { face, hollow, corner, round };

/// Seen from `at` along `way`, forwards or backwards.
template <class Next>
FallsBack falls_back(const Next& next, const Followed& at, const Vec3& way) {
  constexpr Following follow;
  const double along = at.touch.normal.dot(way), aside = (way - along * at.touch.normal).norm(),
               part = std::min(1.0, follow.bends * at.touch.distance / aside), sign = at.s > 0 ? -1 : 1;
  const Followed beside = next(at, at.s + sign * part);
  const double turned = (beside.touch.normal - at.touch.normal).norm();
  if (turned < follow.straight) return FallsBack::face;
  const double back = beside.touch.distance - at.touch.distance - part * along;
  if (back <= 0) return FallsBack::hollow;
  return back < beside.touch.distance * turned * turned ? FallsBack::corner : FallsBack::round;
}

/// The first place at which `holds`, between one where it does not and one where it does.
template <class Next, class Holds>
Followed first_place(const Next& next, const Holds& holds, Followed low, Followed high) {
  while (high.s - low.s > Following{}.exact) {
    const Followed middle = next(low, (low.s + high.s) / 2);
    (holds(middle) ? high : low) = middle;
  }
  return high;
}

}  // namespace

WallTouch on_the_way(const StepWall& wall, const Placement& where, const Vec3& centre, double radius,
                     const Way& way, const WallTouch& touch) {
  constexpr Following follow;
  const double gap = touch.distance - radius, far = touch.distance + 2 * way.before.norm();
  if (wall.plane() || touch.beside || gap <= way.held || touch.normal.dot(way.before) >= 0 ||
      gap + touch.normal.dot(way.loaded) >= 0)
    return touch;
  const auto next = [&](const Followed& last, double s) {
    Followed nearest{s, last.touch, last.place};
    double least = INFINITY;
    for (const WallTouch& now : wall.touches(centre + s * way.before, far, where)) {
      const Vec3 place = centre + s * way.before - now.distance * now.normal;
      if (now.beside || (place - last.place).norm() >= least) continue;
      least = (place - last.place).norm();
      nearest = {s, now, place};
    }
    return nearest;
  };
  std::vector<Followed> all{{0, touch, centre - touch.distance * touch.normal}};
  for (int k = 1; k <= follow.parts; ++k)
    all.push_back(next(all.back(), static_cast<double>(k) / follow.parts));
  if ((all.back().touch.normal - touch.normal).norm() < follow.bends) return touch;
  const auto arrived = [&](const Followed& at) { return at.touch.distance <= radius; };
  const auto leaves = [&](const Followed& at) { return at.touch.normal.dot(way.before) >= 0; };
  Followed nearest = all.back();
  if (const auto found = std::ranges::find_if(all, leaves); found != all.end())
    nearest = first_place(next, leaves, *(found - 1), *found);
  Followed met = nearest;
  if (arrived(nearest)) {
    const auto found = std::ranges::find_if(all, arrived);
    const Followed& high = found == all.end() || found->s > nearest.s ? nearest : *found;
    met = first_place(
        next, arrived,
        *std::prev(std::ranges::find_if(all, [&](const Followed& at) { return at.s >= high.s; })), high);
  }
  const FallsBack here = falls_back(next, all.front(), way.before),
                  there = falls_back(next, met, -way.before);
  if (here == FallsBack::hollow || there == FallsBack::hollow) return touch;
  if (here == FallsBack::corner || there == FallsBack::corner) {
    const double by_loads = met.touch.normal.dot(way.before - way.loaded);
    if (!arrived(nearest)) met.touch.distance += std::clamp(by_loads, 0.0, gap);
    met.touch.distance -= met.s * met.touch.normal.dot(way.before);
    return met.touch;
  }
  if (arrived(nearest)) return touch;
  WallTouch same = touch;
  same.distance = nearest.touch.distance - touch.normal.dot(way.before) +
                  std::clamp(touch.normal.dot(way.before - way.loaded), 0.0, gap);
  return same;
}

}  // namespace talus::audit
