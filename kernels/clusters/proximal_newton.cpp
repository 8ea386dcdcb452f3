#include "kernels/clusters/proximal_newton.hpp"

#include <algorithm>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "kernels/clusters/firm_contacts.hpp"
#include "kernels/global/natural_map.hpp"
#include "kernels/global/stiffness.hpp"
#include "kernels/law/friction_cone.hpp"

namespace talus {

namespace {

std::vector<Twist> sum(const std::vector<Twist>& a, double part, const std::vector<Twist>& b) {
  std::vector<Twist> sum(a);
  for (std::size_t k = 0; k < a.size(); ++k) {
    sum[k].u += part * b[k].u;
    sum[k].w += part * b[k].w;
  }
  return sum;
}

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

/// The convex problem of one step, and where its solution stands.
class ProximalStep {
 public:
  ProximalStep(const BodyProblem& problem, double firmness)
      : firmness(firmness), centre(problem.impulse), motion(problem.bodies.size()), problem_(problem) {
    const std::vector<Twist> V = velocities_of(problem, problem.impulse);
    for (const ContactEquation& c : problem.contacts) {
      velocity_.push_back(constrained(c, relative_velocity(c, V) + c.offset));
      mass_.push_back(effective_mass(problem, c));
      shift.push_back(c.mu * tangential(c, velocity_.back()).norm());
    }
  }

  double firmness;            ///< rho W_nn
  std::vector<Vec3> centre;   ///< t [N s]
  std::vector<double> shift;  ///< s [m/s]
  std::vector<Twist> motion;  ///< d [m/s]

  /// v + b n [m/s].
  Vec3 velocity(std::size_t k, std::span<const Twist> d) const {
    const ContactEquation& c = problem_.contacts[k];
    return velocity_[k] + constrained(c, relative_velocity(c, d));
  }
  /// What is projected on the cone, and its projection [N s].
  Vec3 aim(std::size_t k, std::span<const Twist> d) const {
    return centre[k] - rho(k) * (velocity(k, d) + shift[k] * problem_.contacts[k].normal);
  }
  Vec3 carried(std::size_t k, std::span<const Twist> d) const {
    const ContactEquation& c = problem_.contacts[k];
    return project_on_cone(aim(k, d), c.normal, c.mu);
  }

  /// Minus the gradient: what contacts ask for beyond what bodies have [N s].
  std::vector<Twist> force(std::span<const Twist> d) const {
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

  /// Newton's step from `motion`, where it leaves `force`; its work is taken off.
  std::vector<Twist> way(const std::vector<Twist>& force, double& work) const {
    std::vector<ContactSpring> springs;
    for (std::size_t k = 0; k < problem_.contacts.size(); ++k) add_springs(k, springs);
    const FirmContacts firm(problem_, springs);
    work -= firm.work();
    return firm.solve(force).motion;
  }

 private:
  double rho(std::size_t k) const { return firmness * mass_[k]; }

  /// rho times the derivative of the projection, which is symmetric.
  void add_springs(std::size_t k, std::vector<ContactSpring>& springs) const {
    const ContactEquation& c = problem_.contacts[k];
    const Vec3 z = aim(k, motion), on = project_on_cone(z, c.normal, c.mu);
    if (on == Vec3::Zero()) return;
    if (c.mu == 0) {
      springs.push_back({k, c.normal, rho(k)});
    } else if (on == z) {
      for (int axis = 0; axis < 3; ++axis) springs.push_back({k, Vec3(Vec3::Unit(axis)), rho(k)});
    } else {
      const Vec3 sideways = tangential(c, z);
      springs.push_back({k, on.normalized(), rho(k)});
      springs.push_back(
          {k, c.normal.cross(sideways).normalized(), rho(k) * tangential(c, on).norm() / sideways.norm()});
    }
  }

  const BodyProblem& problem_;
  std::vector<Vec3> velocity_;  ///< v + b n at the impulses of the problem [m/s]
  std::vector<double> mass_;    ///< 1/W_nn [kg]
};

/// Takes the part of Newton's `way` at which the function is least along it. `force` at its beginning, in; at
/// its end, out.
void go_along(const std::vector<Twist>& way, const ProximalThresholds& proximal, ProximalStep& step,
              std::vector<Twist>& force) {
  const double small = proximal.slope * dot(force, way);
  std::vector<Twist> there;
  // force.way falls all the way: where it ends far below 0 it was 0 before.
  for (double low = 0, high = 1, part = 1; high - low > proximal.line * high; part = 0.5 * (low + high)) {
    there = sum(step.motion, part, way);
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

/// How a step has come to its minimum.
struct Minimised {
  double off = 0;          ///< what momentum is off by [N s]
  int factorisations = 0;  ///< that it took
};

/// What momentum may be off by behind a step [N s]: `enough` ends it, beyond `most` it has failed.
struct StepGoal {
  double enough, most;
};

/// `moved`: by which the last step has changed the motion.
StepGoal step_goal(double goal, double moved, const ProximalThresholds& proximal) {
  const double far = moved > proximal.far * goal ? proximal.loose * moved : 0;
  return {std::max(proximal.inner * goal, far), std::max(goal, far)};
}

/// The minimum of a step, until momentum is off by no more than is enough, or by what rounding leaves.
Minimised minimise(const StepGoal& goal, const ProximalThresholds& proximal, ProximalStep& step,
                   double& work) {
  std::vector<Twist> force = step.force(step.motion);
  Minimised result{size_of(force), 0};
  double least = result.off;
  for (int since = 0; result.off > goal.enough; ++since) {
    const int patience = result.off <= goal.most ? proximal.patience_at_goal : proximal.patience;
    if (since >= patience || result.factorisations >= proximal.most || work <= 0) break;
    ++result.factorisations;
    const std::vector<Twist> way = step.way(force, work);
    go_along(way, proximal, step, force);
    result.off = size_of(force);
    if (result.off <= 0.5 * least) {
      least = result.off;
      since = -1;
    }
  }
  return result;
}

/// What a step has come to: its projections are the next centre.
Correction take_step(const BodyProblem& problem, ProximalStep& step) {
  Correction now;
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    const Vec3 r = step.carried(k, step.motion);
    const NaturalMap map = natural_map_of(problem, problem.contacts[k], r, step.velocity(k, step.motion));
    now.open += (r - map.carried).norm();
    now.impulse.push_back(r - problem.impulse[k]);
    step.centre[k] = r;
    step.shift[k] = map.shift;
  }
  now.motion = step.motion;
  now.found = momentum_of(problem, step.motion);
  return now;
}

}  // namespace

Correction proximal_correction(const BodyProblem& problem, double enough,
                               const CorrectionThresholds& thresholds, const ProximalThresholds& proximal,
                               double& work) {
  ProximalStep step(problem, std::min(proximal.first_firmness, thresholds.firmness));
  Correction best;
  best.impulse.assign(problem.contacts.size(), Vec3::Zero());
  best.motion.resize(problem.bodies.size());
  best.open = std::numeric_limits<double>::infinity();
  double firmness = 0, moved = 0;
  int wary = 0;
  for (int k = 1; k <= proximal.most_steps && work > 0 && !best.settled; ++k) {
    const double goal = goal_of(momentum_of(problem, step.motion), enough, thresholds);
    const StepGoal until = step_goal(goal, moved, proximal);
    const std::vector<Twist> before = step.motion;
    const Minimised minimum = minimise(until, proximal, step, work);
    if (!(minimum.off <= until.most)) {
      step.motion = before;
      step.firmness /= proximal.growth;
      if (step.firmness < proximal.least_firmness) break;
      wary = proximal.wary;
      continue;
    }
    Correction now = take_step(problem, step);
    now.rounds = k;
    now.left = minimum.off;
    now.moved = momentum_of(problem, sum(step.motion, -1, before));
    const bool small = now.open <= goal && now.moved <= goal && now.left <= goal;
    // Behind a firmer step a softer one changes less, which says nothing.
    now.missed =
        small && step.firmness >= firmness ? rest_of(moved, now.moved, proximal.inner * goal) : now.moved;
    moved = now.moved;
    now.settled = small && step.firmness >= std::max(firmness, proximal.firm_enough) &&
                  now.missed <= proximal.rest * goal;
    firmness = step.firmness;
    if (now.settled || now.error() < best.error()) best = std::move(now);
    if (wary > 0)
      --wary;
    else if (minimum.factorisations <= proximal.easy)
      step.firmness = std::min(proximal.growth * step.firmness, thresholds.firmness);
  }
  return best;
}

}  // namespace talus
