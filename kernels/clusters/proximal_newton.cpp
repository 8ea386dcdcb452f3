#include "kernels/clusters/proximal_newton.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
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
  ProximalSteps(const BodyProblem& problem, double still, const ProximalThresholds& thresholds)
      : problem_(problem),
        still_(still),
        thresholds_(thresholds),
        step_(problem, thresholds.search.first_firmness) {
    for (const BodyUnknown& body : problem.bodies)
      fastest_ = larger(fastest_, larger(body.free.u.norm(), body.free.w.norm()));
  }

  const std::vector<Twist>& motion() const { return step_.motion; }

  bool solve(const StepStart& start, double& work) {
    began_ = step_.motion;
    began_balanced_ = std::exchange(balanced_, false);
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
    asked_ = 0;
    double largest = 0;
    for (std::size_t k = 0; k < problem_.contacts.size(); ++k) {
      const Vec3 r = step_.carried(k, step_.motion);
      const NaturalMap map =
          natural_map_of(problem_, problem_.contacts[k], r, step_.velocity(k, step_.motion));
      now.open += (r - map.carried).norm();
      if (r != Vec3::Zero()) {
        const ContactEquation& c = problem_.contacts[k];
        closing_ = larger(closing_, std::abs(c.normal.dot(step_.velocity(k, step_.motion))));
        asked_ = larger(asked_, std::abs(c.normal.dot(c.offset)));
      }
      largest = larger(largest, r.norm());
      now.impulse.push_back(r - problem_.impulse[k]);
      step_.centre[k] = r;
      step_.shift[k] = map.shift;
    }
    if (first_largest_ == 0) first_largest_ = largest;
    now.motion = step_.motion;
    now.found = momentum_of(problem_, step_.motion);
    now.left = minimum_.off;
    return now;
  }

  /// Without friction: what pushes the forces on is rounding, of the gaps or of the velocities.
  bool at_rest() const { return closing_ <= larger(still_, thresholds_.rounding * larger(fastest_, asked_)); }

  /// Without friction: along the last change of the impulses to where the dual objective 1/2 |V(r)|_M^2 +
  /// r.offset is least, until a contact opens, or one has changed by the largest. In directions that W hardly
  /// resists single steps, even firm ones, creep. Returns how many times the last change that is.
  double leap(double& work) {
    if (leaps_ >= thresholds_.most_leaps || !balance(work)) return 0;
    const Creep creep = last_change();
    // Forces without bound are none: walls press on what cannot get away.
    const bool bounded = creep.largest <= thresholds_.most_growth * first_largest_;
    const double length = bounded ? std::min(creep.length(), creep.largest / creep.change) : 0;
    if (length >= 1) ++leaps_;
    go_on(length);
    return length;
  }

  /// The same however large the impulses become: whether bodies move where the creep ends. 0 where there is
  /// none, not finite where it does not end; nothing where another step has to come first.
  std::optional<double> follow(double& work) {
    if (!balance(work)) return {};
    const double length = last_change().length();
    if (std::isfinite(length)) go_on(length);
    return length;
  }

  /// Of the impulses since those of the problem.
  std::vector<Vec3> changes() const {
    std::vector<Vec3> change;
    for (std::size_t k = 0; k < step_.centre.size(); ++k)
      change.push_back(step_.centre[k] - problem_.impulse[k]);
    return change;
  }

  bool firmer(bool) const { return minimum_.factorisations <= thresholds_.easy; }

 private:
  /// How the last step has changed the impulses, and how far that may go on, in such changes.
  struct Creep {
    double slope = 0;                                        ///< of the dual objective along it [J]
    double least = std::numeric_limits<double>::infinity();  ///< where that is least
    double opens = std::numeric_limits<double>::infinity();  ///< where the first contact opens
    double largest = 0, change = 0;                          ///< impulse and change of one [N s]
    double length() const { return slope < 0 && change > 0 ? std::min(least, opens) : 0; }
  };

  /// The last step to its end: what its momentum is off by would show in the impulses. False where that is
  /// not so, or the step began with a motion that does not belong to its centres: no direction can be told.
  bool balance(double& work) {
    const std::vector<Vec3> to = std::exchange(step_.centre, before_);
    const std::vector<Twist> motion = step_.motion;
    const Minimised end =
        minimise({0, std::numeric_limits<double>::infinity()}, thresholds_.newton, step_, work);
    if (!(end.off <= minimum_.off)) {
      step_.centre = to;
      step_.motion = motion;
      return false;
    }
    std::vector<Vec3> carried;
    for (std::size_t k = 0; k < before_.size(); ++k) carried.push_back(step_.carried(k, step_.motion));
    step_.centre = std::move(carried);
    balanced_ = true;
    return began_balanced_;
  }

  Creep last_change() const {
    Creep creep;
    for (std::size_t k = 0; k < step_.centre.size(); ++k) {
      const ContactEquation& c = problem_.contacts[k];
      const Vec3 last = step_.centre[k] - before_[k];
      creep.slope += step_.velocity(k, step_.motion).dot(last);
      creep.largest = larger(creep.largest, step_.centre[k].norm());
      creep.change = larger(creep.change, last.norm());
      const double closing = -c.normal.dot(last);
      if (closing > 0 && step_.centre[k] != Vec3::Zero())
        creep.opens = std::min(creep.opens, c.normal.dot(step_.centre[k]) / closing);
    }
    const double norm = kinetic_norm(problem_, added(step_.motion, -1, began_));
    if (norm > 0) creep.least = -creep.slope / (norm * norm);
    return creep;
  }

  /// So many times the last change more.
  void go_on(double length) {
    step_.motion = added(step_.motion, length, added(step_.motion, -1, began_));
    for (std::size_t k = 0; k < step_.centre.size(); ++k) {
      const ContactEquation& c = problem_.contacts[k];
      step_.centre[k] =
          project_on_cone(step_.centre[k] + length * (step_.centre[k] - before_[k]), c.normal, c.mu);
    }
  }

  const BodyProblem& problem_;
  double still_;  ///< ClusterGoal::still [m/s]
  const ProximalThresholds& thresholds_;
  ProximalStep step_;
  std::vector<Vec3> before_;     ///< centres of the last step [N s]
  std::vector<Twist> began_;     ///< and the motion where it began [m/s]
  bool began_balanced_ = false;  ///< that motion is the one of those centres, but for rounding
  bool balanced_ = false;        ///< likewise the present ones
  int leaps_ = 0;
  double first_largest_ = 0;  ///< impulse behind the first step [N s]
  double fastest_ = 0;        ///< of the bodies without contacts [m/s]
  double closing_ = 0;        ///< fastest normal velocity of contacts that carry behind the last step [m/s]
  double asked_ = 0;          ///< and the fastest that these ask for [m/s]
  Minimised minimum_;
};

}  // namespace

StepsCorrection proximal_correction(const BodyProblem& problem, const ClusterGoal& goal,
                                    const CorrectionThresholds& thresholds,
                                    const ProximalThresholds& proximal, double& work) {
  ProximalSteps steps(problem, goal.still, proximal);
  return search_by_steps(problem, goal, thresholds, proximal.search, steps, work);
}

}  // namespace talus
