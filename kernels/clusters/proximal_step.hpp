#pragma once

/// One proximal step: contacts that yield in proportion to what pushes them beyond given impulses, a strictly
/// convex problem, and its minimum. Steps of proximal_newton.hpp follow one another to the answer of a
/// cluster; ever firmer ones show where there is none (admissible.hpp).

#include <span>
#include <vector>

#include "kernels/global/body_problem.hpp"

namespace talus {

/// Every number that the search for a minimum depends on. Ratios have no unit.
struct MinimumThresholds {
  int most = 25;  ///< factorisations, >= 1
  /// A step of Newton's method may go beyond the minimum along its way until the slope is this part of the
  /// first one, in (0, 1); and how well the minimum is found where it goes further, likewise.
  double slope = 0.1, line = 0.1;
  /// Factorisations that have not halved what momentum is off by, after which a search ends; and where it is
  /// within the goal: nothing but rounding is left.
  int patience = 15, patience_at_goal = 3;
};

/// The convex problem of one step: with centres t and shifts s, the change d of the velocities that makes
///
///   1/2 |d|_M^2 + r.H^T d + sum 1/(2 rho) |P_Kmu(t - rho (v + H^T d + s n))|^2,   rho: firmness / W_nn,
///
/// least. It keeps the address of the problem.
class ProximalStep {
 public:
  /// Around the impulses of the problem, whose velocities make s = mu |v_t|.
  ProximalStep(const BodyProblem& problem, double firmness);

  double firmness;            ///< rho W_nn
  std::vector<Vec3> centre;   ///< t [N s]
  std::vector<double> shift;  ///< s [m/s]
  std::vector<Twist> motion;  ///< d [m/s]

  /// v + b n [m/s].
  Vec3 velocity(std::size_t k, std::span<const Twist> d) const;
  /// P_Kmu(...) [N s].
  Vec3 carried(std::size_t k, std::span<const Twist> d) const;
  /// Minus the gradient: what contacts ask for beyond what bodies have [N s].
  std::vector<Twist> force(std::span<const Twist> d) const;
  /// Newton's step from `motion`, where it leaves `force`; its work is taken off.
  std::vector<Twist> way(const std::vector<Twist>& force, double& work) const;

 private:
  double rho(std::size_t k) const { return firmness * mass_[k]; }
  Vec3 aim(std::size_t k, std::span<const Twist> d) const;

  const BodyProblem& problem_;
  std::vector<Vec3> velocity_;  ///< v + b n at the impulses of the problem [m/s]
  std::vector<double> mass_;    ///< 1/W_nn [kg]
};

/// What momentum may be off by behind a step [N s]: `enough` ends it, beyond `most` it has failed.
struct StepGoal {
  double enough, most;
};

/// How a step has come to its minimum.
struct Minimised {
  double off = 0;          ///< what momentum is off by [N s]
  int factorisations = 0;  ///< that it took
};

/// Moves `step.motion` to the minimum, until momentum is off by no more than is enough, or by what rounding
/// leaves. `work`: multiplications after which no more factorisations begin, in; what is left of them, out.
Minimised minimise(const StepGoal& goal, const MinimumThresholds& newton, ProximalStep& step, double& work);

}  // namespace talus
