#include "kernels/shapes/clump.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace talus {

namespace {

constexpr double four_thirds_pi = 4.18879020478639098;

double volume_of(const Ball& ball) {
  return four_thirds_pi * ball.radius * ball.radius * ball.radius;
}

void refuse_nonsense(std::span<const Ball> balls) {
  if (balls.empty() || balls.size() > most_balls)
    throw std::invalid_argument("a clump has 1 to " + std::to_string(most_balls) + " balls, not " +
                                std::to_string(balls.size()));
  for (std::size_t k = 0; k < balls.size(); ++k)
    if (!balls[k].centre.allFinite() || !(balls[k].radius > 0) || !std::isfinite(balls[k].radius))
      throw std::invalid_argument("ball " + std::to_string(k) +
                                  " of a clump needs a finite centre [m] and a finite radius > 0 [m]");
}

/// About the centre of mass, of density 1 [kg m^2].
Mat3 inertia_of(std::span<const Ball> balls, const Vec3& centre) {
  Mat3 inertia = Mat3::Zero();
  for (const Ball& ball : balls) {
    const double mass = volume_of(ball);
    const Vec3 d = ball.centre - centre;
    inertia.diagonal().array() += mass * (0.4 * ball.radius * ball.radius + d.squaredNorm());
    inertia -= mass * d * d.transpose();
  }
  return inertia;
}

}  // namespace

PlacedClump make_clump(std::span<const Ball> balls) {
  refuse_nonsense(balls);
  PlacedClump placed;
  double volume = 0;
  for (const Ball& ball : balls) {
    volume += volume_of(ball);
    placed.centre += volume_of(ball) * ball.centre;
  }
  placed.centre /= volume;
  for (const Ball& ball : balls)
    placed.radius = std::max(placed.radius, (ball.centre - placed.centre).norm() + ball.radius);

  const Eigen::SelfAdjointEigenSolver<Mat3> principal(inertia_of(balls, placed.centre));
  Mat3 axes = principal.eigenvectors();
  if (axes.determinant() < 0) axes.col(2) = -axes.col(2);
  const Eigen::Quaterniond q(axes);
  placed.orientation = {q.w(), q.x(), q.y(), q.z()};

  const double R = placed.radius;
  Clump& clump = placed.clump;
  clump.inertia = principal.eigenvalues() / (volume * R * R);
  clump.volume = volume / (R * R * R);
  clump.smallest = std::ranges::min_element(balls, {}, &Ball::radius)->radius / R;
  for (const Ball& ball : balls)
    clump.balls.push_back({axes.transpose() * (ball.centre - placed.centre) / R, ball.radius / R});
  return placed;
}

Mat3 rotation_of(const std::array<double, 4>& q) {
  return Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix();
}

Ball ball_of(const ClumpView& view, std::size_t slot, std::size_t number, const Vec3& x, double radius) {
  if (!view.is_clump(slot)) return {x, radius};
  const Ball& ball = view.of(slot).balls[number];
  return {x + radius * (rotation_of(view.orientation[slot]) * ball.centre), radius * ball.radius};
}

}  // namespace talus
