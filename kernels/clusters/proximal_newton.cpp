#include "kernels/clusters/proximal_newton.hpp"

#include <algorithm>
#include <vector>

#include "kernels/global/natural_map.hpp"

namespace talus {

namespace {

/// Convex steps (search_by_steps), whose projections are the next centre.
class ProximalSteps {
 public:
  ProximalSteps(const BodyProblem& problem, const ProximalThresholds& thresholds)
      : problem_(problem), thresholds_(thresholds), step_(problem, thresholds.search.first_firmness) {}

  const std::vector<Twist>& motion() const { return step_.motion; }

  bool solve(const StepStart& start, double& work) {
    const std::vector<Twist> before = step_.motion;
    step_.firmness = start.firmness;
    const double far = start.moved > thresholds_.far * start.goal ? thresholds_.loose * start.moved : 0;
    const StepGoal goal{std::max(thresholds_.search.inner * start.goal, far), std::max(start.goal, far)};
    minimum_ = minimise(goal, thresholds_.newton, step_, work);
    if (minimum_.off <= goal.most) return true;
    step_.motion = before;
    return false;
  }

  Correction take() {
    Correction now;
    for (std::size_t k = 0; k < problem_.contacts.size(); ++k) {
      const Vec3 r = step_.carried(k, step_.motion);
      const NaturalMap map =
          natural_map_of(problem_, problem_.contacts[k], r, step_.velocity(k, step_.motion));
      now.open += (r - map.carried).norm();
      now.impulse.push_back(r - problem_.impulse[k]);
      step_.centre[k] = r;
      step_.shift[k] = map.shift;
    }
    now.motion = step_.motion;
    now.found = momentum_of(problem_, step_.motion);
    now.left = minimum_.off;
    return now;
  }

  bool firmer(bool) const { return minimum_.factorisations <= thresholds_.easy; }

 private:
  const BodyProblem& problem_;
  const ProximalThresholds& thresholds_;
  ProximalStep step_;
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
