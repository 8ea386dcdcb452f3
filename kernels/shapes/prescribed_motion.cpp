#include "kernels/shapes/prescribed_motion.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace talus {

namespace {

constexpr double two_pi = 6.28318530717958648;

/// Time that a part has moved for at a time of the run [s].
double time_moved(const MotionPart& part, double time) {
  return time <= part.begin ? 0 : std::min(time, part.end) - part.begin;
}

/// Row at or before t >= 0; beyond the end the last but one, whose slope goes on.
std::size_t row_before(const MotionTable& table, double t) {
  const auto next = std::upper_bound(table.t.begin() + 1, table.t.end() - 1, t);
  return static_cast<std::size_t>(next - table.t.begin()) - 1;
}

Displacement read(const MotionTable& table, double t) {
  const std::size_t k = row_before(table, t);
  const double span = table.t[k + 1] - table.t[k], part = (t - table.t[k]) / span;
  Displacement found;
  if (!table.velocity.empty())
    found.shift =
        table.shift[k] +
        (t - table.t[k]) * (table.velocity[k] + 0.5 * part * (table.velocity[k + 1] - table.velocity[k]));
  else if (!table.shift.empty())
    found.shift = table.shift[k] + part * (table.shift[k + 1] - table.shift[k]);
  if (!table.angle.empty()) found.angle = table.angle[k] + part * (table.angle[k + 1] - table.angle[k]);
  return found;
}

Displacement moved_for(const MotionPart& part, double t) {
  switch (part.kind) {
    case MotionPart::Kind::velocity:
      return {t * part.velocity, 0};
    case MotionPart::Kind::rotation:
      return {Vec3::Zero(), t * part.rate};
    case MotionPart::Kind::oscillation:
      return {part.amplitude * (std::sin(two_pi * part.frequency * t + part.phase) - std::sin(part.phase)) *
                  part.direction,
              0};
    case MotionPart::Kind::table:
      return read(*part.table, t);
  }
  return {};
}

Eigen::Quaterniond turn_by(const Vec3& axis, double angle) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle, axis));
}

/// The vector whose exponential is this rotation.
Vec3 logarithm(const Eigen::Quaterniond& q) {
  const double sine = q.vec().norm();
  if (sine == 0) return Vec3::Zero();
  const double angle = 2 * std::atan2(sine, q.w());
  return angle / sine * q.vec();
}

/// Of a body that turns by phi and moves one of its points by u within a unit of time: the velocity of that
/// point, by the inverse of the exponential's left Jacobian.
Vec3 velocity_of_twist(const Vec3& phi, const Vec3& u) {
  const double angle2 = phi.squaredNorm();
  if (angle2 == 0) return u;
  const double angle = std::sqrt(angle2), half = 0.5 * angle;
  const double k = angle < 1e-3 ? 1.0 / 12 : (1 - half / std::tan(half)) / angle2;
  return u - 0.5 * phi.cross(u) + k * phi.cross(phi.cross(u));
}

/// Rotations of the parts, one after the other.
struct Turning {
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
  Vec3 shift = Vec3::Zero();
  void then(const Vec3& point, const Eigen::Quaterniond& q) {
    shift = point + q * (shift - point);
    turn = (q * turn).normalized();
  }
};

}  // namespace

MotionPart rotation_part(const Vec3& axis, const Vec3& point, double rate) {
  MotionPart part;
  part.kind = MotionPart::Kind::rotation;
  part.axis = axis.normalized();
  part.point = point;
  part.rate = rate;
  return part;
}

MotionPart oscillation_part(const Vec3& direction, double amplitude, double frequency, double phase) {
  MotionPart part;
  part.kind = MotionPart::Kind::oscillation;
  part.direction = direction.normalized();
  part.amplitude = amplitude;
  part.frequency = frequency;
  part.phase = phase;
  return part;
}

void integrate(MotionTable& table) {
  table.shift.assign(table.t.size(), Vec3::Zero());
  for (std::size_t k = 1; k < table.t.size(); ++k)
    table.shift[k] = table.shift[k - 1] +
                     0.5 * (table.t[k] - table.t[k - 1]) * (table.velocity[k - 1] + table.velocity[k]);
}

Displacement displacement(const MotionPart& part, double time) {
  return moved_for(part, time_moved(part, time));
}

Displacement advance(const MotionPart& part, double time, double h) {
  const bool throughout = part.begin <= time && time + h <= part.end;
  const double t = time_moved(part, time), dt = throughout ? h : time_moved(part, time + h) - t;
  switch (part.kind) {
    case MotionPart::Kind::velocity:
    case MotionPart::Kind::rotation:
      return moved_for(part, dt);
    case MotionPart::Kind::oscillation: {
      const double half = 0.5 * two_pi * part.frequency * dt;
      const double middle = two_pi * part.frequency * t + part.phase + half;
      return {2 * part.amplitude * std::cos(middle) * std::sin(half) * part.direction, 0};
    }
    case MotionPart::Kind::table:
      break;
  }
  const Displacement then = moved_for(part, t), now = moved_for(part, t + dt);
  return {now.shift - then.shift, now.angle - then.angle};
}

Pose pose_at(std::span<const MotionPart> parts, double time) {
  Turning turning;
  Vec3 shift = Vec3::Zero();
  Pose pose;
  for (const MotionPart& part : parts) {
    if (part.surface_only) continue;
    pose.moved = true;
    const Displacement by = displacement(part, time);
    shift += by.shift;
    if (part.turns()) turning.then(part.point, turn_by(part.axis, by.angle));
  }
  if (!pose.moved) return pose;
  pose.turn = turning.turn.toRotationMatrix();
  pose.shift = turning.shift + shift;
  return pose;
}

Vec3 RigidVelocity::at(const Vec3& c) const {
  return velocity + omega.cross(c - pivot);
}

RigidVelocity mean_velocity(std::span<const MotionPart> parts, double time, double h) {
  RigidVelocity mean;
  Vec3 way = Vec3::Zero(), shift = Vec3::Zero(), point = Vec3::Zero();
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
  int rotations = 0;
  for (const MotionPart& part : parts) {
    if (part.surface_only) continue;
    const Displacement by = advance(part, time, h);
    way += by.shift;
    shift += displacement(part, time).shift;
    if (!part.turns()) continue;
    const Eigen::Quaterniond now = turn_by(part.axis, displacement(part, time).angle);
    turn = turn_by(part.axis, by.angle) * (now * turn * now.conjugate());
    point = part.point;
    ++rotations;
  }
  mean.pivot = point + shift;
  if (rotations > 1) {
    // The rotations before the last one carry its pivot away.
    const Vec3 first = pose_at(parts, time).back(mean.pivot);
    way = pose_at(parts, time + h).of(first) - mean.pivot;
  }
  const Vec3 phi = logarithm(turn);
  mean.omega = phi / h;
  mean.velocity = velocity_of_twist(phi, way) / h;
  return mean;
}

RigidVelocity mean_surface_velocity(std::span<const MotionPart> parts, double time, double h,
                                    const Vec3& pivot) {
  const Pose pose = pose_at(parts, time);
  RigidVelocity sum;
  sum.pivot = pivot;
  for (const MotionPart& part : parts) {
    if (!part.surface_only) continue;
    const Displacement by = advance(part, time, h);
    sum.velocity += pose.turned(by.shift) / h;
    if (!part.turns()) continue;
    const Vec3 omega = by.angle / h * pose.turned(part.axis);
    sum.omega += omega;
    sum.velocity += omega.cross(pivot - pose.of(part.point));
  }
  return sum;
}

double largest_acceleration(std::span<const MotionPart> parts) {
  double sum = 0;
  for (const MotionPart& part : parts)
    if (part.kind == MotionPart::Kind::oscillation && !part.surface_only) {
      const double pulsation = two_pi * part.frequency;
      sum += std::abs(part.amplitude) * pulsation * pulsation;
    }
  return sum;
}

double shortest_period(std::span<const MotionPart> parts) {
  double period = std::numeric_limits<double>::infinity();
  for (const MotionPart& part : parts)
    if (part.kind == MotionPart::Kind::oscillation && part.amplitude != 0)
      period = std::min(period, 1 / part.frequency);
  return period;
}

}  // namespace talus
