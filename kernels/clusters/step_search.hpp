#pragma once

/// Proximal steps, one after another, to the answer of a cluster: what those of Coulomb's law
/// (coulomb_newton.hpp) and the convex ones (proximal_newton.hpp) have in common.

#include <algorithm>
#include <cmath>
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
  int creeps = 2;
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

/// The best of the steps, settled where further ones would change next to nothing. `work`: multiplications
/// after which no more steps begin, in; what is left of them, out. `Steps` has
///
///   std::vector<Twist> motion() const      since the impulses of the problem [m/s]
///   bool solve(StepStart, double& work)    the problem of the next step; where false nothing has changed
///   Correction take()                      its impulses and motion, `found`, `open` and `left`; the next
///                                          step goes on from there
///   bool firmer(bool small) const          whether the next one may be firmer; `small`: what is left of this
///                                          one is within the goal
///
/// and may have, for problems without friction,
///
///   bool at_rest() const                   what changes the impulses yet is rounding
///   double leap(double& work)              goes on as the last step has changed the impulses, so many times
///   std::optional<double> follow(double&)  likewise, however far, where velocities have settled
///   std::vector<Vec3> changes() const      the impulses then, since those of the problem
///
/// and for problems with friction
///
///   std::optional<double> to_come(const Correction&, const ClusterGoal&, double& work) const
///                                          what steps behind this one may still change, where that is little
///                                          enough to be an answer [N s]
///   double creep_on()                      goes on as the last step has changed the impulses, so many times
template <class Steps>
Correction search_by_steps(const BodyProblem& problem, const ClusterGoal& asked,
                           const CorrectionThresholds& thresholds, const SearchThresholds& search,
                           Steps& steps, double& work) {
  Correction best;
  best.impulse.assign(problem.contacts.size(), Vec3::Zero());
  best.motion.resize(problem.bodies.size());
  best.open = std::numeric_limits<double>::infinity();
  const bool friction = has_friction(problem);
  double firmness = std::min(search.first_firmness, thresholds.firmness), last = 0, moved = 0;
  std::vector<Vec3> impulse = best.impulse;
  int wary = 0, idle = 0, followed = 0, vain = 0;
  double open = std::numeric_limits<double>::infinity();  // before the idle steps
  for (int k = 1; k <= search.most_steps && work > 0 && !best.settled && idle < search.idle; ++k) {
    const std::vector<Twist> before = steps.motion();
    const double goal = goal_of(momentum_of(problem, before), asked.enough, thresholds);
    if (!steps.solve({firmness, goal, moved}, work)) {
      firmness /= search.growth;
      if (firmness < search.least_firmness) break;
      wary = search.wary;
      continue;
    }
    Correction now = steps.take();
    now.rounds = k;
    now.moved = momentum_of(problem, added(now.motion, -1, before));
    const bool small = now.open <= goal && now.moved <= goal && now.left <= goal;
    // Behind a firmer step a softer one changes less, which says nothing.
    const bool comparable = small && firmness >= last;
    now.missed = comparable ? rest_of(moved, now.moved, search.inner * goal) : now.moved;
    now.pushed = pushed_by(problem, impulse, now.impulse);
    // In directions that W hardly resists impulses creep the further the firmer a step is; where they need
    // not be known only the firmest steps tell that velocities do not creep as well.
    bool known = friction || now.pushed * thresholds.firmness <= thresholds.same_forces * firmness;
    if constexpr (requires { steps.at_rest(); }) known = known || steps.at_rest();
    const bool creeps = !known;
    if (!asked.forces) known = known || firmness >= thresholds.firmness;
    now.settled = comparable && known && firmness >= search.firm_enough && now.missed <= search.rest * goal;
    if (friction && !now.settled)
      if (const double rest = larger(now.moved, beyond_rounding(problem, now, asked.enough, thresholds));
          rest <= asked.enough) {
        now.missed = rest;
        now.settled = true;
      }
    if constexpr (requires { steps.to_come(now, asked, work); })
      if (!now.settled && std::isfinite(last))
        if (const std::optional<double> rest = steps.to_come(now, asked, work)) {
          now.missed = *rest;
          now.settled = true;
        }
    impulse = now.impulse;
    moved = now.moved;
    last = firmness;
    // A creep that moves nobody may open a contact, and then it does.
    if constexpr (requires { steps.follow(work); })
      if (now.settled && creeps && followed < search.follows) {
        now.settled = false;
        const std::optional<double> length = steps.follow(work);
        // Without an end, or not known: nothing is, and what has been found before is no better.
        if (length ? !std::isfinite(*length) : ++vain > search.vain) break;
        if (length && *length == 0) followed = search.follows;  // nothing creeps
        if (length && *length > 0) {
          ++followed;
          last = std::numeric_limits<double>::infinity();
        }
        impulse = steps.changes();
      }
    if constexpr (requires { steps.leap(work); })
      if (small && !known && firmness >= search.firm_enough) {
        // What follows a leap tells nothing of what is still to come.
        if (steps.leap(work) > 0) last = std::numeric_limits<double>::infinity();
        impulse = steps.changes();
      }
    const bool rests = friction && firmness >= thresholds.firmness && now.moved <= goal;
    idle = rests && now.open > search.shrinks * open ? idle + 1 : 0;
    if (idle == 0) open = now.open;
    if constexpr (requires { steps.creep_on(); })
      if (idle >= search.creeps && !now.settled && steps.creep_on() > 0) {
        last = std::numeric_limits<double>::infinity();
        idle = 0;
      }
    if (wary > 0)
      --wary;
    else if (steps.firmer(small))
      firmness = std::min(search.growth * firmness, thresholds.firmness);
    if (now.settled || now.error() < best.error()) best = std::move(now);
  }
  best.stuck = !best.settled && idle >= search.idle;
  return best;
}

}  // namespace talus
