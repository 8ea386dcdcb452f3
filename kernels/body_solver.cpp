#include "kernels/body_solver.hpp"

namespace talus {

namespace {

double dot(std::span<const Twist> a, std::span<const Twist> b) {
  double sum = 0;
  for (std::size_t k = 0; k < a.size(); ++k) sum += talus::dot(a[k], b[k]);
  return sum;
}

}  // namespace

BodySolver::BodySolver(const BodyProblem& problem, std::span<const double> rho, int aggregate)
    : aggregates_(grow_aggregates(problem, aggregate)),
      system_(problem, rho),
      coarse_(problem, aggregates_, rho),
      residual_(problem.bodies.size()),
      z_(residual_.size()),
      direction_(residual_.size()),
      product_(residual_.size()),
      rest_(residual_.size()) {}

double BodySolver::precondition() {
  system_.smooth_forward(residual_, z_, rest_);
  coarse_.correct(rest_, z_);
  system_.smooth_backward(residual_, z_);
  return dot(residual_, z_);
}

double BodySolver::begin(std::span<const Twist> f, std::span<Twist> V) {
  system_.multiply(V, product_);
  for (std::size_t b = 0; b < residual_.size(); ++b) {
    residual_[b].u = f[b].u - product_[b].u;
    residual_[b].w = f[b].w - product_[b].w;
  }
  left_ = precondition();
  direction_ = z_;
  return left_;
}

double BodySolver::iterate(std::span<Twist> V) {
  system_.multiply(direction_, product_);
  const double curvature = dot(direction_, product_);
  if (!(curvature > 0)) return 0;
  const double step = left_ / curvature;
  for (std::size_t b = 0; b < residual_.size(); ++b) {
    V[b].u += step * direction_[b].u;
    V[b].w += step * direction_[b].w;
    residual_[b].u -= step * product_[b].u;
    residual_[b].w -= step * product_[b].w;
  }
  const double next = precondition();
  const double beta = next / left_;
  left_ = next;
  for (std::size_t b = 0; b < residual_.size(); ++b) {
    direction_[b].u = z_[b].u + beta * direction_[b].u;
    direction_[b].w = z_[b].w + beta * direction_[b].w;
  }
  return next;
}

}  // namespace talus
