#include "kernels/balance.hpp"

#include <vector>

#include "kernels/admm.hpp"
#include "kernels/body_solver.hpp"

namespace talus {

namespace {

/// rho W_nn over estimate_stiffness. That looks at masses and layers only: in a wedge of half angle a the
/// load excites an eigenvalue smaller by sin^2 a.
constexpr double firmness = 1e4;
/// Of the conjugate gradients' error over what they found.
constexpr double linear_tolerance = 0.1;
constexpr int max_linear = 100;
/// They see a preconditioned residual, which is smaller than the error.
constexpr double caution = 3;
/// Of the impulses between walls, over those of the step: what is smaller is of no interest.
constexpr double interest = 1e-2;

/// What the contacts that carry ask of the velocities.
struct Wishes {
  BodyProblem problem;       ///< those contacts only
  std::vector<Vec3> change;  ///< of the relative velocity, y - v [m/s]
  double drive = 0;          ///< fastest drive among them [m/s]
  double pressed = 0;        ///< sum of the impulses at walls [N s]
};

Wishes wishes_of(const BodyProblem& problem, std::span<const Twist> V) {
  Wishes wishes;
  wishes.problem.bodies = problem.bodies;
  wishes.problem.grains = problem.grains;
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    ContactEquation c = problem.contacts[k];
    const Vec3& n = c.normal;
    const double m = effective_mass(problem, c);
    const auto along = [&](const Vec3& z) { return Vec3(z - n.dot(z) * n); };
    const Vec3 v = constrained(c, relative_velocity(c, V) + c.offset), &r = problem.impulse[k];
    if (c.second < 0 || problem.bodies[static_cast<std::size_t>(c.second)].wall)
      wishes.pressed += std::abs(n.dot(r));
    const Vec3 shifted = v + c.mu * along(v).norm() * n;
    const Vec3 carried = project_on_cone(r - m * shifted, n, c.mu);
    if (carried == Vec3::Zero()) continue;
    const Vec3 y = shifted + (carried - r) / m, slip = along(y);
    Vec3 change = y - c.mu * slip.norm() * n - v;
    const double most = c.mu * n.dot(carried);
    if (c.mu > 0 && slip != Vec3::Zero() && along(carried).norm() > (1 - 1e-6) * most) {
      c.mu = 0;  // it slides: along the plane it asks for nothing
      change = n.dot(change) * n;
    }
    if (c.second < 0) wishes.drive = std::max(wishes.drive, c.offset.norm());
    wishes.problem.contacts.push_back(c);
    wishes.problem.impulse.push_back(r);
    wishes.change.push_back(change);
  }
  return wishes;
}

}  // namespace

VelocityError velocity_error(const BodyProblem& problem, double enough) {
  VelocityError error;
  std::vector<Twist> V = velocities_of(problem, problem.impulse);
  const Wishes wishes = wishes_of(problem, V);
  if (wishes.change.empty()) return error;

  double mass = 0;
  for (std::size_t b = 0; b < V.size(); ++b) {
    V[b].u -= problem.bodies[b].free.u;
    V[b].w -= problem.bodies[b].free.w;
    mass += problem.bodies[b].mass;
  }
  const double other = wishes.drive > 0 ? mass * wishes.drive * wishes.drive
                                        : interest * interest * wishes.pressed * wishes.pressed / mass;
  const double scale2 = std::max(kinetic2(problem, V), other);

  const double kappa = firmness * estimate_stiffness(problem);
  std::vector<double> rho;
  for (const ContactEquation& c : wishes.problem.contacts) rho.push_back(kappa * effective_mass(problem, c));
  BodySolver solver(wishes.problem, rho, aggregate_target(problem.grains));
  std::vector<Twist> force(V.size()), motion(V.size());
  for (std::size_t k = 0; k < rho.size(); ++k)
    add_force(wishes.problem.contacts[k], rho[k] * wishes.change[k], force);
  for (std::size_t b = 0; b < V.size(); ++b) restrict_to_freedoms(problem.bodies[b], force[b]);

  double left = solver.begin(force, motion), found = 0;
  const double least = enough * enough * scale2, part = linear_tolerance * linear_tolerance;
  while (error.linear_iterations < max_linear && left > part * std::max(found, least)) {
    left = solver.iterate(motion);
    found = kinetic2(problem, motion);
    ++error.linear_iterations;
  }
  error.relative = (std::sqrt(found) + caution * std::sqrt(left)) / std::sqrt(scale2);
  return error;
}

}  // namespace talus
