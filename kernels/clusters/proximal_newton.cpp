#include "kernels/clusters/proximal_newton.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "kernels/bodies/larger.hpp"
#include "kernels/global/natural_map.hpp"
#include "kernels/law/friction_cone.hpp"

namespace talus {

namespace {

/// Convex steps (search_by_steps), whose projections are the next centre.
class ProximalSteps {
 public:
  ProximalSteps(const BodyProblem& problem, const ProximalThresholds& thresholds)
      : problem_(problem), thresholds_(thresholds), step_(problem, thresholds.search.first_firmness) {
    for (const BodyUnknown& body : problem.bodies) fastest_ = larger(fastest_, body.free.u.norm());
    for (const ContactEquation& c : problem.contacts) fastest_ = larger(fastest_, c.offset.norm());
  }

  const std::vector<Twist>& motion() const { return step_.motion; }

  bool solve(const StepStart& start, double& work) {
    began_ = step_.motion;
    step_.firmness = start.firmness;
    const double far = start.moved > thresholds_.far * start.goal ? thresholds_.loose * start.moved : 0;
    const StepGoal goal{std::max(thresholds_.search.inner * start.goal, far), std::max(start.goal, far)};
    minimum_ = minimise(goal, thresholds_.newton, step_, work);
    if (minimum_.off <= goal.most) return true;
    step_.motion = began_;
    return false;
  }

  Correction take() {
    Correction now;
    before_ = step_.centre;
    closing_ = 0;
    for (std::size_t k = 0; k < problem_.contacts.size(); ++k) {
      const Vec3 r = step_.carried(k, step_.motion);
      const NaturalMap map =
          natural_map_of(problem_, problem_.contacts[k], r, step_.velocity(k, step_.motion));
      now.open += (r - map.carried).norm();
      if (r != Vec3::Zero())
        closing_ =
            larger(closing_, std::abs(problem_.contacts[k].normal.dot(step_.velocity(k, step_.motion))));
      now.impulse.push_back(r - problem_.impulse[k]);
      step_.centre[k] = r;
      step_.shift[k] = map.shift;
    }
    now.motion = step_.motion;
    now.found = momentum_of(problem_, step_.motion);
    now.left = minimum_.off;
    return now;
  }

  /// Without friction: what pushes the forces on is rounding of the gaps.
  bool at_rest() const { return closing_ <= thresholds_.rounding * fastest_; }

  /// Without friction: along the last change of the impulses to where the dual objective 1/2 |V(r)|_M^2 +
  /// r.offset is least, until a contact opens, or one has changed by the largest. In directions that W hardly
  /// resists single steps, even firm ones, creep.
  std::vector<Vec3> leap(double& work) {
    // The last step to the end: what its momentum is off by would show in the impulses.
    step_.centre = before_;
    minimise({0, std::numeric_limits<double>::infinity()}, thresholds_.newton, step_, work);
    std::vector<Vec3> carried;
    for (std::size_t k = 0; k < before_.size(); ++k) carried.push_back(step_.carried(k, step_.motion));
    step_.centre = std::move(carried);
    const std::vector<Twist> by = added(step_.motion, -1, began_);
    const double part = leaps_++ < thresholds_.most_leaps ? length_of_leap(by) : 0;
    step_.motion = added(step_.motion, part, by);
    std::vector<Vec3> impulse;
    for (std::size_t k = 0; k < step_.centre.size(); ++k) {
      const ContactEquation& c = problem_.contacts[k];
      step_.centre[k] =
          project_on_cone(step_.centre[k] + part * (step_.centre[k] - before_[k]), c.normal, c.mu);
      impulse.push_back(step_.centre[k] - problem_.impulse[k]);
    }
    return impulse;
  }

  bool firmer(bool) const { return minimum_.factorisations <= thresholds_.easy; }

 private:
  /// Over the last change, which has moved the bodies `by`.
  double length_of_leap(const std::vector<Twist>& by) const {
    double slope = 0, largest = 0, change = 0, opens = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < step_.centre.size(); ++k) {
      const ContactEquation& c = problem_.contacts[k];
      const Vec3 last = step_.centre[k] - before_[k];
      slope += step_.velocity(k, step_.motion).dot(last);
      largest = larger(largest, step_.centre[k].norm());
      change = larger(change, last.norm());
      const double closing = -c.normal.dot(last);
      if (closing > 0) opens = std::min(opens, c.normal.dot(step_.centre[k]) / closing);
    }
    const double norm = kinetic_norm(problem_, by);
    const double least = norm > 0 ? -slope / (norm * norm) : std::numeric_limits<double>::infinity();
    return slope < 0 && change > 0 ? std::min({least, opens, largest / change}) : 0;
  }

  const BodyProblem& problem_;
  const ProximalThresholds& thresholds_;
  ProximalStep step_;
  std::vector<Vec3> before_;  ///< centres of the last step [N s]
  std::vector<Twist> began_;  ///< and the motion where it began [m/s]
  int leaps_ = 0;
  double fastest_ = 0;  ///< of the bodies without contacts, and of what contacts ask for [m/s]
  double closing_ = 0;  ///< fastest normal velocity of those that carry behind the last step [m/s]
  Minimised minimum_;
};

}  // namespace

Correction proximal_correction(const BodyProblem& problem, double enough,
                               const CorrectionThresholds& thresholds, const ProximalThresholds& proximal,
                               double& work) {
  ProximalSteps steps(problem, proximal);
  return search_by_steps(problem, enough, thresholds, proximal.search, steps, work);
}

}  // namespace talus
