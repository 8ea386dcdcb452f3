#include "apps/study_certificate/step_clump.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

namespace talus::audit {

namespace {

Eigen::Quaterniond of(const Turn& q) {
  return {q[0], q[1], q[2], q[3]};
}

/// Inertia over mass in the axes of the scene.
Mat3 gyration_at(const Mat3& gyration, const Eigen::Quaterniond& q) {
  const Mat3 axes = q.normalized().toRotationMatrix();
  return axes * gyration * axes.transpose();
}

/// q, and then a turn with angular velocity omega for so long.
Eigen::Quaterniond turned(const Eigen::Quaterniond& q, const Vec3& omega, double time) {
  const double speed = omega.norm();
  if (speed == 0) return q;
  return Eigen::Quaterniond(Eigen::AngleAxisd(time * speed, omega / speed)) * q;
}

}  // namespace

BallBody sized(const Clump& clump, double radius) {
  BallBody body;
  double sum = 0;
  Mat3 gyration = Mat3::Zero();
  for (const Ball& ball : clump.balls) {
    const Vec3 centre = radius * ball.centre;
    const double r = radius * ball.radius, cube = r * r * r;
    body.balls.push_back({centre, r});
    sum += cube;
    gyration +=
        cube * ((0.4 * r * r + centre.squaredNorm()) * Mat3::Identity() - centre * centre.transpose());
  }
  body.gyration = gyration / sum;
  return body;
}

Vec3 momentum_of(const Mat3& gyration, double mass, const ClumpTurn& turn) {
  return mass * gyration_at(gyration, of(turn.orientation)) * turn.omega;
}

TurnedClump turned_half(const BallBody& body, double mass, double radius, const ClumpTurn& turn,
                        double time_step) {
  TurnedClump clump;
  clump.gyration = body.gyration;
  clump.momentum = momentum_of(body.gyration, mass, turn);
  const Eigen::Quaterniond begin = of(turn.orientation).normalized();
  const auto omega_at = [&](const Eigen::Quaterniond& q) {
    return Vec3((mass * gyration_at(body.gyration, q)).inverse() * clump.momentum);
  };
  const Eigen::Quaterniond quarter = turned(begin, omega_at(begin), time_step / 4),
                           half = turned(begin, omega_at(quarter), time_step / 2);
  clump.axes = half.normalized().toRotationMatrix();
  clump.inertia = mass * gyration_at(body.gyration, half);
  const double J = clump.inertia.trace() / (3 * radius * radius);
  clump.spin_mobility = 1 / J;
  clump.lengths = Eigen::SelfAdjointEigenSolver<Mat3>(clump.inertia / J).operatorSqrt();
  for (const Ball& ball : body.balls) clump.balls.push_back({clump.axes * ball.centre, ball.radius});
  return clump;
}

}  // namespace talus::audit
