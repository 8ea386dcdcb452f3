#include "kernels/clusters/proximal_step.hpp"

#include <cmath>
#include <utility>

#include "kernels/clusters/firm_contacts.hpp"
#include "kernels/clusters/motion_norms.hpp"
#include "kernels/global/stiffness.hpp"
#include "kernels/law/friction_cone.hpp"

namespace talus {

namespace {

double dot(const std::vector<Twist>& a, const std::vector<Twist>& b) {
  double sum = 0;
  for (std::size_t k = 0; k < a.size(); ++k) sum += talus::dot(a[k], b[k]);
  return sum;
}

/// Sum of |f| over the bodies [N s].
double size_of(const std::vector<Twist>& force) {
  double sum = 0;
  for (const Twist& f : force) sum += f.u.norm() + f.w.norm();
  return sum;
}

/// rho times the derivative of the projection of z, which is symmetric.
void add_springs(std::size_t k, const ContactEquation& c, const Vec3& z, double rho,
                 std::vector<ContactSpring>& springs) {
  const Vec3 on = project_on_cone(z, c.normal, c.mu);
  if (on == Vec3::Zero()) return;
  if (c.mu == 0) {
    springs.push_back({k, c.normal, rho});
  } else if (on == z) {
    for (int axis = 0; axis < 3; ++axis) springs.push_back({k, Vec3(Vec3::Unit(axis)), rho});
  } else {
    const Vec3 sideways = tangential(c, z);
    springs.push_back({k, on.normalized(), rho});
    springs.push_back(
        {k, c.normal.cross(sideways).normalized(), rho * tangential(c, on).norm() / sideways.norm()});
  }
}

/// Takes the part of Newton's `way` at which the function is least along it. `force` at its beginning, in; at
/// its end, out.
void go_along(const std::vector<Twist>& way, const MinimumThresholds& newton, ProximalStep& step,
              std::vector<Twist>& force) {
  const double small = newton.slope * dot(force, way);
  std::vector<Twist> there;
  // force.way falls all the way: where it ends far below 0 it was 0 before.
  for (double low = 0, high = 1, part = 1; high - low > newton.line * high; part = 0.5 * (low + high)) {
    there = added(step.motion, part, way);
    force = step.force(there);
    const double falls = dot(force, way);
    if (falls < -small)
      high = part;
    else if (falls > small && part < 1)
      low = part;
    else
      break;
  }
  step.motion = std::move(there);
}

}  // namespace

ProximalStep::ProximalStep(const BodyProblem& problem, double firmness)
    : firmness(firmness), centre(problem.impulse), motion(problem.bodies.size()), problem_(problem) {
  const std::vector<Twist> V = velocities_of(problem, problem.impulse);
  for (const ContactEquation& c : problem.contacts) {
    velocity_.push_back(constrained_velocity(c, V));
    mass_.push_back(effective_mass(problem, c));
    shift.push_back(c.mu * tangential(c, velocity_.back()).norm());
  }
}

Vec3 ProximalStep::velocity(std::size_t k, std::span<const Twist> d) const {
  const ContactEquation& c = problem_.contacts[k];
  return velocity_[k] + constrained(c, relative_velocity(c, d));
}

/// What is projected on the cone.
Vec3 ProximalStep::aim(std::size_t k, std::span<const Twist> d) const {
  return centre[k] - rho(k) * (velocity(k, d) + shift[k] * problem_.contacts[k].normal);
}

Vec3 ProximalStep::carried(std::size_t k, std::span<const Twist> d) const {
  const ContactEquation& c = problem_.contacts[k];
  return project_on_cone(aim(k, d), c.normal, c.mu);
}

std::vector<Twist> ProximalStep::force(std::span<const Twist> d) const {
  std::vector<Twist> force(problem_.bodies.size());
  for (std::size_t k = 0; k < problem_.contacts.size(); ++k)
    add_force(problem_.contacts[k], Vec3(carried(k, d) - problem_.impulse[k]), force);
  for (std::size_t b = 0; b < force.size(); ++b) {
    restrict_to_freedoms(problem_.bodies[b], force[b]);
    force[b].u -= problem_.bodies[b].mass * d[b].u;
    force[b].w -= problem_.bodies[b].spin_mass * d[b].w;
  }
  return force;
}

std::vector<Twist> ProximalStep::way(const std::vector<Twist>& force, double& work) const {
  std::vector<ContactSpring> springs;
  for (std::size_t k = 0; k < problem_.contacts.size(); ++k) {
    const ContactEquation& c = problem_.contacts[k];
    add_springs(k, c, aim(k, motion), rho(k), springs);
  }
  const FirmContacts firm(problem_, springs);
  work -= firm.work();
  return firm.solve(force).motion;
}

Minimised minimise(const StepGoal& goal, const MinimumThresholds& newton, ProximalStep& step, double& work) {
  std::vector<Twist> force = step.force(step.motion);
  Minimised result{size_of(force), 0};
  double least = result.off;
  for (int since = 0; result.off > goal.enough; ++since) {
    const int patience = result.off <= goal.most ? newton.patience_at_goal : newton.patience;
    if (since >= patience || result.factorisations >= newton.most || work <= 0) break;
    ++result.factorisations;
    const std::vector<Twist> way = step.way(force, work);
    go_along(way, newton, step, force);
    result.off = size_of(force);
    if (result.off <= 0.5 * least) {
      least = result.off;
      since = -1;
    }
  }
  return result;
}

}  // namespace talus
