#include "kernels/clusters/coulomb_newton.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "kernels/bodies/larger.hpp"
#include "kernels/clusters/coulomb_step.hpp"
#include "kernels/clusters/rolling_contacts.hpp"

namespace talus {

namespace {

using Vector = Eigen::VectorXd;

/// Grains and walls of a cluster.
std::ptrdiff_t bodies_of(const BodyProblem& problem) {
  return std::ssize(problem.bodies) - (problem.has_cell() ? 1 : 0);
}

/// Loops that pairs of bodies close which have contacts, in a cluster, and contacts with walls that are none
/// of its bodies: all those walls together are one body more.
std::ptrdiff_t loops_of(const BodyProblem& problem) {
  std::vector<std::array<std::int32_t, 2>> pairs;
  std::ptrdiff_t grounded = 0;
  for (const ContactEquation& c : problem.contacts) {
    if (c.second >= 0)
      pairs.push_back({std::min(c.first, c.second), std::max(c.first, c.second)});
    else
      ++grounded;
  }
  std::sort(pairs.begin(), pairs.end());
  const auto pairs_end = std::unique(pairs.begin(), pairs.end());
  const std::ptrdiff_t bodies = bodies_of(problem) + (grounded > 0 ? 1 : 0);
  return pairs_end - pairs.begin() + grounded - bodies + 1;
}

/// Steps of Coulomb's law (search_by_steps), whose impulses are the next t.
class CoulombSteps {
 public:
  CoulombSteps(const BodyProblem& problem, const CoulombThresholds& thresholds)
      : problem_(problem),
        thresholds_(thresholds),
        step_(problem),
        d_(step_.none()),
        loops_(loops_of(problem)),
        rolling_(has_rolling(problem)) {
    for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
      next_.t.push_back({problem.impulse[k]});
      if (rolling_) next_.t.back().m = problem.rolling[k].moment;
      open_ += step_.wrong(k, d_, next_.t.back());
    }
  }

  std::vector<Twist> motion() const { return step_.twists(d_); }

  bool solve(const StepStart& start, double& work) {
    const Vector before = d_;
    next_.firmness = start.firmness;
    began_ = next_;
    const double enough = thresholds_.search.inner * std::max(start.goal, open_);
    const double most = std::max(start.goal, thresholds_.loose * open_);
    Vector f = step_.residual(d_, began_), way;
    off_ = step_.size(f);
    for (int k = 0; k < thresholds_.most_iterations && off_ > enough && work > 0; ++k)
      if (!step_.way(d_, f, began_, way, work) || !go_along(way, f)) break;
    if (off_ <= most) return true;
    d_ = before;
    return false;
  }

  Correction take() {
    Correction now;
    for (std::size_t k = 0; k < problem_.contacts.size(); ++k) {
      const Carried carried = step_.carried(k, d_, began_);
      now.open += step_.wrong(k, d_, carried);
      now.impulse.push_back(carried.r - problem_.impulse[k]);
      if (rolling_) now.moment.push_back(carried.m - problem_.rolling[k].moment);
      next_.t[k] = carried;
    }
    now.knows_moments = true;
    now.left = off_;
    now.motion = motion();
    now.found = momentum_of(problem_, now.motion);
    slow_ = now.open > thresholds_.slow * open_;
    open_ = now.open;
    return now;
  }

  std::optional<double> to_come(const Correction& now, const ClusterGoal& goal, double& work) const {
    const CoulombThresholds::Known& known = thresholds_.known;
    const double least =
        std::max(static_cast<double>(known.loops), known.looped * static_cast<double>(bodies_of(problem_)));
    if (static_cast<double>(loops_) <= least) return {};
    const double left = known.left * goal.enough, most = known.to_come * goal.enough;
    if (now.open > left || now.left > left || known.steps * now.moved > most) return {};
    const LinearRest linear = step_.linear_rest(d_, began_, known.firmness, work);
    const double rest = std::max(known.steps * now.moved, linear.momentum);
    const bool creeps = goal.relative <= known.fine && !(linear.impulse <= known.forces * goal.relative);
    if (creeps || !(rest <= most)) return {};
    return rest;
  }
  bool firmer(bool small) const { return slow_ || small; }

 private:
  /// Takes the part of an iteration that makes the residual f smaller. False where none does.
  bool go_along(const Vector& way, Vector& f) {
    Vector there;
    double part = 1, after = off_;
    for (int halving = 0; halving <= thresholds_.halvings; ++halving, part /= 2) {
      there = d_ + part * way;
      f = step_.residual(there, began_);
      after = step_.size(f);
      if (after <= (1 - thresholds_.descent * part) * off_) break;
    }
    if (!(after < off_)) return false;
    d_ = there;
    off_ = after;
    return true;
  }

  const BodyProblem& problem_;
  const CoulombThresholds& thresholds_;
  CoulombStep step_;
  CoulombStart began_;    ///< of the last step
  CoulombStart next_;     ///< of the next one, its firmness aside
  Vector d_;              ///< per freedom [m/s]
  double off_ = 0;        ///< what momentum is off by behind it [N s]
  double open_ = 0;       ///< what the law finds wrong there, sum of |r - P_Kmu(...)| [N s]
  std::ptrdiff_t loops_;  ///< loops_of
  bool rolling_;          ///< some contacts resist rolling
  bool slow_ = false;     ///< that is hardly less than before it
};

}  // namespace

Correction coulomb_correction(const BodyProblem& problem, const ClusterGoal& goal,
                              const CorrectionThresholds& thresholds, const CoulombThresholds& coulomb,
                              double& work) {
  CoulombSteps steps(problem, coulomb);
  return search_by_steps(problem, goal, thresholds, coulomb.search, steps, work);
}

}  // namespace talus
