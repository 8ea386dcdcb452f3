#include "kernels/clusters/proximal_newton.hpp"

#include <algorithm>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "kernels/clusters/firm_contacts.hpp"
#include "kernels/global/natural_map.hpp"
#include "kernels/global/stiffness.hpp"

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
  ProximalStep(const BodyProblem& problem, double firmness) : firmness(firmness), problem_(problem) {
    const std::vector<Twist> V = velocities_of(problem, problem.impulse);
    for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
      const ContactEquation& c = problem.contacts[k];
      velocity_.push_back(c.normal.dot(relative_velocity(c, V) + c.offset));
      mass_.push_back(effective_mass(problem, c));
      centre.push_back(std::max(0.0, c.normal.dot(problem.impulse[k])));
    }
    motion.resize(problem.bodies.size());
  }

  double firmness;             ///< rho W_nn
  std::vector<double> centre;  ///< t [N s]
  std::vector<Twist> motion;   ///< d [m/s]

  /// v_n + b [m/s].
  double velocity(std::size_t k, std::span<const Twist> d) const {
    const ContactEquation& c = problem_.contacts[k];
    return velocity_[k] + c.normal.dot(relative_velocity(c, d));
  }
  /// max(0, t - rho (v_n + b)) [N s].
  double carried(std::size_t k, std::span<const Twist> d) const {
    return std::max(0.0, centre[k] - firmness * mass_[k] * velocity(k, d));
  }

  /// Minus the gradient: what contacts ask for beyond what bodies have [N s].
  std::vector<Twist> force(std::span<const Twist> d) const {
    std::vector<Twist> force(problem_.bodies.size());
    for (std::size_t k = 0; k < problem_.contacts.size(); ++k) {
      const ContactEquation& c = problem_.contacts[k];
      add_force(c, carried(k, d) * c.normal - problem_.impulse[k], force);
    }
    for (std::size_t b = 0; b < force.size(); ++b) {
      restrict_to_freedoms(problem_.bodies[b], force[b]);
      force[b].u -= problem_.bodies[b].mass * d[b].u;
      force[b].w -= problem_.bodies[b].spin_mass * d[b].w;
    }
    return force;
  }

  /// Newton's step from `motion`, where it leaves `force`.
  std::vector<Twist> way(const std::vector<Twist>& force) const {
    std::vector<ContactSpring> springs;
    for (std::size_t k = 0; k < problem_.contacts.size(); ++k)
      if (carried(k, motion) > 0) springs.push_back({k, problem_.contacts[k].normal, firmness * mass_[k]});
    return FirmContacts(problem_, springs).solve(force).motion;
  }

 private:
  const BodyProblem& problem_;
  std::vector<double> velocity_;  ///< v_n + b at the impulses of the problem [m/s]
  std::vector<double> mass_;      ///< 1/W_nn [kg]
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

/// The minimum of a step, until momentum is off by no more than `enough` or by what rounding leaves [N s],
/// which is returned. `factorisations`: that may be used, in; that are left, out.
double minimise(double enough, const ProximalThresholds& proximal, ProximalStep& step, int& factorisations) {
  std::vector<Twist> force = step.force(step.motion);
  double least = size_of(force);
  for (int since = 0; size_of(force) > enough && since < proximal.patience && factorisations > 0; ++since) {
    --factorisations;
    const std::vector<Twist> way = step.way(force);
    go_along(way, proximal, step, force);
    if (size_of(force) <= 0.5 * least) {
      least = size_of(force);
      since = -1;
    }
  }
  return size_of(force);
}

/// What a step has come to: its projections are the next centre.
Correction take_step(const BodyProblem& problem, ProximalStep& step) {
  Correction now;
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    const ContactEquation& c = problem.contacts[k];
    step.centre[k] = step.carried(k, step.motion);
    const Vec3 r = step.centre[k] * c.normal;
    now.open += (r - natural_map_of(problem, c, r, step.velocity(k, step.motion) * c.normal).carried).norm();
    now.impulse.push_back(r - problem.impulse[k]);
  }
  now.motion = step.motion;
  now.found = momentum_of(problem, step.motion);
  return now;
}

}  // namespace

Correction proximal_correction(const BodyProblem& problem, double enough,
                               const CorrectionThresholds& thresholds, const ProximalThresholds& proximal) {
  ProximalStep step(problem, proximal.first_firmness);
  Correction best;
  best.impulse.assign(problem.contacts.size(), Vec3::Zero());
  best.motion.resize(problem.bodies.size());
  best.open = std::numeric_limits<double>::infinity();
  int factorisations = proximal.most_factorisations;
  for (int k = 1; k <= proximal.most_steps && factorisations > 0 && !best.settled; ++k) {
    const double wanted = proximal.inner * goal_of(momentum_of(problem, step.motion), enough, thresholds);
    const double left = minimise(wanted, proximal, step, factorisations);
    Correction now = take_step(problem, step);
    now.left = left;
    now.rounds = k;
    const double goal = goal_of(now.found, enough, thresholds);
    now.settled = now.open <= goal && now.left <= goal;
    if (now.settled || now.error() < best.error()) best = std::move(now);
    step.firmness = std::min(proximal.growth * step.firmness, thresholds.firmness);
  }
  return best;
}

}  // namespace talus
