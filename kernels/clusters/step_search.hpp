#pragma once

/// Proximal steps, one after another, to the answer of a cluster: what those of Coulomb's law
/// (coulomb_newton.hpp) and the convex ones (proximal_newton.hpp) have in common.

#include <algorithm>
#include <cmath>
#include <concepts>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "kernels/clusters/correction.hpp"
#include "kernels/clusters/proximal_step.hpp"

namespace talus {

/// Every number that a search by steps depends on. Ratios have no unit.
struct SearchThresholds {
  /// rho W_nn of the first step, > 0. Soft contacts find out who carries; firm ones leave little to mend. So
  /// a step whose kind allows it is followed by one that is `growth`, > 1, times as firm, up to
  /// CorrectionThresholds::firmness.
  double first_firmness, growth = 5;
  /// A step whose problem is not solved is taken back and tried again, softer by `growth`; the next `wary`
  /// steps, >= 0, get no firmer. Below `least_firmness`, > 0, the search ends.
  int wary = 2;
  double least_firmness = 1;
  int most_steps;  ///< >= 1
  /// Momentum may be off by this part of the goal behind a step, in (0, 1).
  double inner = 1e-2;
  /// No softer step settles, > 0: of directions that W hardly resists, as in a chain, it shows too little.
  /// (With friction one may that leaves nothing but rounding: beyond_rounding.)
  /// And what further steps would change, by how the last two did, may be so many goals, >= 1.
  double firm_enough = 1e6, rest = 10;
  /// With friction a search ends after so many steps of the greatest firmness, >= 1, that move no more than
  /// the goal and leave what the law finds wrong as it is: contacts are taken to press against one another
  /// without end, as grains do between walls that close on them where friction keeps them.
  int idle = 20;
  /// As it is: more than this part of it, in (0, 1), is left behind all of them.
  double shrinks = 0.9;
  /// After so many of them, >= 1, impulses that creep go on at once to where a contact changes its state.
  int idle_before_leap = 2;
  /// Velocities that have settled while impulses creep on have to stay where the creep ends, so many times
  /// one after another, >= 1; and after so many steps, >= 1, that do not tell where that is they are not
  /// known.
  int follows = 4, vain = 8;
};

/// Where a step begins, and what is asked of it.
struct StepStart {
  double firmness;  ///< rho W_nn
  double goal;      ///< what may be left (goal_of) [N s]
  double moved;     ///< by which the last step has changed the motion [N s]
};

/// What steps have found. `missed`: what further ones may still change [N s].
struct StepsCorrection {
  Correction best;
  bool stuck = false;  ///< they went on without moving or mending anything (SearchThresholds::idle)
};

/// Steps of one kind, of which each goes on where the one before has ended.
template <class S>
concept ProximalStepKind = requires(S steps, const S& begun, const StepStart& start, bool small,
                                    double& work) {
  /// Since the impulses of the problem [m/s].
  { begun.motion() } -> std::convertible_to<std::vector<Twist>>;
  /// The problem of the next step; where false nothing has changed.
  { steps.solve(start, work) } -> std::same_as<bool>;
  /// Impulses and motion behind it, `found`, `open` and `left`.
  { steps.take() } -> std::same_as<Correction>;
  /// Whether the next one may be firmer. `small`: what is left of this one is within the goal.
  { begun.firmer(small) } -> std::same_as<bool>;
};

/// Those that see through creeping impulses of problems without friction.
template <class S>
concept SeesThroughCreep = requires(S steps, const S& begun, double& work) {
  /// What changes the impulses yet is rounding.
  { begun.at_rest() } -> std::same_as<bool>;
  /// Goes on as the last step has changed the impulses, so many times; 0 for none.
  { steps.leap(work) } -> std::same_as<double>;
  /// Likewise, however far, where velocities have settled: 0 where nothing creeps, not finite where the creep
  /// has no end, nothing where that is not known.
  { steps.follow(work) } -> std::same_as<std::optional<double>>;
  /// Of the impulses then, since those of the problem [N s].
  { begun.changes() } -> std::same_as<std::vector<Vec3>>;
};

/// Those that foresee what is to come of problems with friction.
template <class S>
concept ForeseesRest = requires(S steps, const S& begun, const Correction& now, const ClusterGoal& goal,
                                double& work) {
  /// What steps behind this one, which has moved the bodies by `moved` [N s], may still change, where that
  /// is little enough to be an answer [N s].
  { begun.to_come(now, double(), goal, work) } -> std::same_as<std::optional<double>>;
  /// Goes on as the last step has changed the impulses, where that leads anywhere.
  { steps.creep_on() } -> std::same_as<bool>;
};

/// One search, for its best step.
template <ProximalStepKind Steps>
class StepSearch {
 public:
  StepSearch(const BodyProblem& problem, const ClusterGoal& asked, const CorrectionThresholds& thresholds,
             const SearchThresholds& search, Steps& steps)
      : problem_(problem),
        asked_(asked),
        thresholds_(thresholds),
        search_(search),
        steps_(steps),
        friction_(has_friction(problem)),
        firmness_(std::min(search.first_firmness, thresholds.firmness)),
        impulse_(problem.contacts.size(), Vec3(Vec3::Zero())) {
    best_.impulse = impulse_;
    best_.motion.resize(problem.bodies.size());
    best_.open = std::numeric_limits<double>::infinity();
  }

  StepsCorrection run(double& work) {
    for (int k = 0; k < search_.most_steps && work > 0 && !best_.settled && idle_ < search_.idle; ++k)
      if (!step(work)) break;
    const bool stuck = !best_.settled && idle_ >= search_.idle;
    return {std::move(best_), stuck};
  }

 private:
  /// How a step has left things.
  struct Outcome {
    double goal;          ///< what may be left (goal_of) [N s]
    double moved;         ///< momentum by which it has changed the motion [N s]
    bool small;           ///< what is left is within the goal
    bool creeps;          ///< impulses may go on to change, and velocities with them
    bool impulses_known;  ///< as far as they need be
  };

  /// The next step. False where the search is to end.
  bool step(double& work) {
    const std::vector<Twist> before = steps_.motion();
    const double goal = goal_of(momentum_of(problem_, before), asked_.enough, thresholds_);
    if (!steps_.solve({firmness_, goal, moved_}, work)) return soften();
    Correction now = steps_.take();
    const Outcome outcome = judge(now, before, goal, work);
    if (!follow_creep(outcome, now, work)) return false;
    leap_without_friction(outcome, work);
    leap_where_idle(outcome, now);
    if (wary_ > 0)
      --wary_;
    else if (steps_.firmer(outcome.small))
      firmness_ = std::min(search_.growth * firmness_, thresholds_.firmness);
    if (now.settled || now.error() < best_.error()) best_ = std::move(now);
    return true;
  }

  /// Behind a step that was not solved. False where none can be any softer.
  bool soften() {
    firmness_ /= search_.growth;
    wary_ = search_.wary;
    return firmness_ >= search_.least_firmness;
  }

  /// Whether the step has settled, and what it lacks.
  Outcome judge(Correction& now, const std::vector<Twist>& before, double goal, double& work) {
    const double moved = momentum_of(problem_, added(now.motion, -1, before));
    const bool small = now.open <= goal && moved <= goal && now.left <= goal;
    // Behind a firmer step a softer one changes less, which says nothing; nor does what follows a leap.
    const bool comparable = small && compared_ && firmness_ >= *compared_;
    now.missed = comparable ? rest_of(moved_, moved, search_.inner * goal) : moved;
    Outcome outcome{goal, moved, small, creeps_yet(now), true};
    outcome.impulses_known = !outcome.creeps || (!asked_.forces && firmness_ >= thresholds_.firmness);
    now.settled = comparable && outcome.impulses_known && firmness_ >= search_.firm_enough &&
                  now.missed <= search_.rest * goal;
    if (friction_ && !now.settled)
      if (const double rest = larger(moved, beyond_rounding(problem_, now, asked_.enough, thresholds_));
          rest <= asked_.enough)
        settle(rest, now);
    if constexpr (ForeseesRest<Steps>)
      if (!now.settled && compared_)
        if (const std::optional<double> rest = steps_.to_come(now, moved, asked_, work)) settle(*rest, now);
    impulse_ = now.impulse;
    moved_ = moved;
    compared_ = firmness_;
    return outcome;
  }

  static void settle(double missed, Correction& now) {
    now.missed = missed;
    now.settled = true;
  }

  /// In directions that W hardly resists impulses creep the further the firmer a step is; where they need not
  /// be known only the firmest steps tell that velocities do not creep as well. With friction the other
  /// conditions tell.
  bool creeps_yet(const Correction& now) const {
    if (friction_ || pushed_by(problem_, impulse_, now.impulse) * thresholds_.firmness <=
                         thresholds_.same_forces * firmness_)
      return false;
    if constexpr (SeesThroughCreep<Steps>) return !steps_.at_rest();
    return true;
  }

  /// A creep that moves nobody may open a contact, and then it does. False where it has no end, or is not
  /// known: nothing is then, and what has been found before is no better.
  bool follow_creep(const Outcome& outcome, Correction& now, double& work) {
    if constexpr (SeesThroughCreep<Steps>) {
      if (!now.settled || !outcome.creeps || followed_ >= search_.follows) return true;
      now.settled = false;
      const std::optional<double> length = steps_.follow(work);
      if (length ? !std::isfinite(*length) : ++vain_ > search_.vain) return false;
      if (length && *length == 0) followed_ = search_.follows;
      if (length && *length > 0) {
        ++followed_;
        compared_.reset();
      }
      impulse_ = steps_.changes();
    }
    return true;
  }

  void leap_without_friction(const Outcome& outcome, double& work) {
    if constexpr (SeesThroughCreep<Steps>) {
      if (!outcome.small || outcome.impulses_known || firmness_ < search_.firm_enough) return;
      if (steps_.leap(work) > 0) compared_.reset();
      impulse_ = steps_.changes();
    }
  }

  /// Counts steps that neither move nor mend anything; with friction their impulses go on at once.
  void leap_where_idle(const Outcome& outcome, const Correction& now) {
    const bool rests = friction_ && firmness_ >= thresholds_.firmness && outcome.moved <= outcome.goal;
    idle_ = rests && now.open > search_.shrinks * open_ ? idle_ + 1 : 0;
    if (idle_ == 0) open_ = now.open;
    if constexpr (ForeseesRest<Steps>)
      if (idle_ >= search_.idle_before_leap && !now.settled && steps_.creep_on()) {
        compared_.reset();
        idle_ = 0;
      }
  }

  const BodyProblem& problem_;
  const ClusterGoal& asked_;
  const CorrectionThresholds& thresholds_;
  const SearchThresholds& search_;
  Steps& steps_;
  const bool friction_;
  Correction best_;
  double firmness_;                     ///< of the next step
  std::optional<double> compared_ = 0;  ///< of the last one; none behind a leap, which tells nothing of what
                                        ///< is still to come
  double moved_ = 0;                    ///< momentum by which the last one has changed the motion [N s]
  std::vector<Vec3> impulse_;           ///< changes of impulses where the next one begins [N s]
  int wary_ = 0, idle_ = 0, followed_ = 0, vain_ = 0;      ///< steps so far (SearchThresholds)
  double open_ = std::numeric_limits<double>::infinity();  ///< before the idle steps [N s]
};

/// The best of the steps, settled where further ones would change next to nothing. `work`: multiplications
/// after which no more steps begin, in; what is left of them, out.
template <ProximalStepKind Steps>
StepsCorrection search_by_steps(const BodyProblem& problem, const ClusterGoal& asked,
                                const CorrectionThresholds& thresholds, const SearchThresholds& search,
                                Steps& steps, double& work) {
  return StepSearch<Steps>(problem, asked, thresholds, search, steps).run(work);
}

}  // namespace talus
