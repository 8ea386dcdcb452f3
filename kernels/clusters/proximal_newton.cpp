#include "kernels/clusters/proximal_newton.hpp"

#include <algorithm>
#include <limits>
#include <utility>
#include <vector>

#include "kernels/clusters/proximal_step.hpp"
#include "kernels/global/natural_map.hpp"

namespace talus {

namespace {

/// `moved`: by which the last step has changed the motion.
StepGoal step_goal(double goal, double moved, const ProximalThresholds& proximal) {
  const double far = moved > proximal.far * goal ? proximal.loose * moved : 0;
  return {std::max(proximal.inner * goal, far), std::max(goal, far)};
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
    const Minimised minimum = minimise(until, proximal.newton, step, work);
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
