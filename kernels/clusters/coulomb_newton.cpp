#include "kernels/clusters/coulomb_newton.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
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

/// Loops that pairs of bodies close which have contacts, in a cluster.
std::ptrdiff_t loops_of(const BodyProblem& problem) {
  std::vector<std::array<std::int32_t, 2>> pairs;
  for (const ContactEquation& c : problem.contacts)
    if (c.second >= 0) pairs.push_back({std::min(c.first, c.second), std::max(c.first, c.second)});
  std::sort(pairs.begin(), pairs.end());
  const auto pairs_end = std::unique(pairs.begin(), pairs.end());
  return pairs_end - pairs.begin() - bodies_of(problem) + 1;
}

/// An impulse, and how it changes, along the normal and across it.
struct Creep {
  double normal = 0, normal_change = 0;
  Vec3 tangential = Vec3::Zero(), tangential_change = Vec3::Zero();
};

/// The number of such changes after which it opens; infinite where it never does.
double changes_until_it_opens(const Creep& creep) {
  return creep.normal_change < 0 ? -creep.normal / creep.normal_change
                                 : std::numeric_limits<double>::infinity();
}

/// After which it slides, of one that sticks with friction mu: |t + x dt| = mu (n + x dn).
double changes_until_it_slides(const Creep& creep, double mu) {
  const auto& [n, dn, t, dt] = creep;
  const double a = dt.squaredNorm() - mu * mu * dn * dn, b = t.dot(dt) - mu * mu * n * dn,
               c = t.squaredNorm() - mu * mu * n * n, root2 = b * b - a * c;
  const double ends = root2 >= 0 ? b + std::sqrt(root2) : 0;
  return ends > 0 ? -c / ends : std::numeric_limits<double>::infinity();
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

  std::optional<double> to_come(const Correction& now, double moved, const ClusterGoal& goal,
                                double& work) const {
    const CoulombThresholds::Known& known = thresholds_.known;
    const double least =
        std::max(static_cast<double>(known.loops), known.looped * static_cast<double>(bodies_of(problem_)));
    if (static_cast<double>(loops_) <= least) return {};
    const double left = known.left * goal.enough, most = known.to_come * goal.enough;
    if (now.open > left || now.left > left || known.steps * moved > most) return {};
    const LinearRest linear = step_.linear_rest(d_, began_, known.firmness, work);
    const double rest = std::max(known.steps * moved, linear.momentum);
    const bool creeps = goal.relative <= known.fine && !(linear.impulse <= known.forces * goal.relative);
    if (creeps || !(rest <= most)) return {};
    return rest;
  }
  bool firmer(bool small) const { return slow_ || small; }

  /// Along the last change of the impulses until a contact opens or begins to slide, or one has changed by
  /// the largest. Jammed grains press one another by what redundant contacts take long to let go of: a step
  /// of firmness 1e9 took a thousandth of it off. False where less than such a change more leads there.
  bool creep_on() {
    double length = std::numeric_limits<double>::infinity(), largest = 0, most = 0;
    for (std::size_t k = 0; k < problem_.contacts.size(); ++k) {
      const Creep creep = last_change(k);
      largest = larger(largest, next_.t[k].r.norm());
      most = larger(most, (next_.t[k].r - began_.t[k].r).norm());
      if (creep.normal <= 0) continue;
      length = std::min(length, changes_until_it_opens(creep));
      const double mu = problem_.contacts[k].mu;
      if (creep.tangential.norm() < (1 - thresholds_.sliding) * mu * creep.normal)
        length = std::min(length, changes_until_it_slides(creep, mu));
    }
    if (first_largest_ == 0) first_largest_ = largest;
    if (rolling_ || leaps_ >= thresholds_.most_leaps || largest > thresholds_.most_growth * first_largest_)
      return false;
    if (!(most > 0)) return false;
    length = std::min(length, largest / most);
    if (!(length >= 1)) return false;
    ++leaps_;
    for (std::size_t k = 0; k < problem_.contacts.size(); ++k) {
      const Creep creep = last_change(k);
      const double n = std::max(0.0, creep.normal + length * creep.normal_change),
                   most_friction = problem_.contacts[k].mu * n;
      Vec3 t = creep.tangential + length * creep.tangential_change;
      if (const double size = t.norm(); size > most_friction) t *= most_friction / size;
      next_.t[k].r = n * problem_.contacts[k].normal + t;
    }
    return true;
  }

 private:
  /// By which the last step has changed the impulse of contact k.
  Creep last_change(std::size_t k) const {
    const ContactEquation& c = problem_.contacts[k];
    const Vec3 &now = next_.t[k].r, change = now - began_.t[k].r;
    return {c.normal.dot(now), c.normal.dot(change), tangential(c, now), tangential(c, change)};
  }

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
  int leaps_ = 0;
  double first_largest_ = 0;  ///< impulse before the first leap [N s]
};

}  // namespace

StepsCorrection coulomb_correction(const BodyProblem& problem, const ClusterGoal& goal,
                                   const CorrectionThresholds& thresholds, const CoulombThresholds& coulomb,
                                   double& work) {
  CoulombSteps steps(problem, coulomb);
  return search_by_steps(problem, goal, thresholds, coulomb.search, steps, work);
}

}  // namespace talus
