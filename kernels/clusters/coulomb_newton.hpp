#pragma once

/// The answer of a cluster with friction by proximal steps that are Coulomb's law as it is: friction follows
/// the normal impulse, and its direction the slip, within a step, where those of proximal_newton.hpp follow
/// from one step to the next. Jammed grains, whose sliding contacts creep there by hundreds of steps or go to
/// and fro, are solved by it (docs/decisions/0024-certificate.md).

#include "kernels/clusters/clusters.hpp"
#include "kernels/clusters/step_search.hpp"

namespace talus {

/// Every number that these steps depend on. Ratios have no unit.
struct CoulombThresholds {
  /// A step is followed by a firmer one where it leaves more than `slow`, in (0, 1), of what the law found
  /// wrong before.
  SearchThresholds search{.first_firmness = 40, .most_steps = 400};
  double slow = 0.3;
  /// Momentum may be off by SearchThresholds::inner of what the law found wrong before a step, if that is
  /// more than the goal; and by this part of it, in (0, 1), where nothing makes it less.
  double loose = 0.1;
  /// Of Newton's method within a step: iterations; halvings of one; and the part of an iteration's length
  /// by which it has to make the residual smaller, in (0, 1).
  int most_iterations = 25, halvings = 5;
  double descent = 0.1;
  /// Impulses that creep, as those of jammed grains that press one another harder than they need: leaps along
  /// them at most, >= 0. Each may double the largest one, until this is so many times that of the first step,
  /// >= 1. Contacts slide that have all but this part of the friction they may have, in (0, 1).
  int most_leaps = 60;
  double most_growth = 100, sliding = 1e-9;
  /// When velocities count as known though impulses still creep, as redundant contacts let them do for
  /// hundreds of steps. What is asked for is ErrorGoal::enough.
  struct Known {
    /// Bodies that touch close more loops than this, >= 0, ...
    std::int32_t loops = 20;
    /// ... and than this part of their number, >= 0, as chains do not.
    double looped = 0.2;
    /// The law finds no more wrong, nor is momentum off by more, than this part of what is asked for, in
    /// (0, 1), ...
    double left = 0.02;
    /// ... and what is still to come is within this part of it, in (0, 1).
    double to_come = 0.5;
    /// To come are so many steps like the last, > 1, as contacts may change (in a heap of 190 grains at rest
    /// 300 further steps changed at most 1.4 times as much), ...
    double steps = 20;
    /// ... or, if that is more, all that would follow if none changed, as a step of this firmness, >> 1,
    /// shows.
    double firmness = 1e9;
    /// By such a step no impulse changes by more than so many times what is asked for, > 0, over the largest,
    double forces = 2;
    /// where at most this is asked for, in (0, 1): a fifth (CertificateThresholds::velocity_resolution) of a
    /// balance_tolerance of 5e-3, and a tenth for rounding. Coarser tolerances speak of velocities: beds at
    /// rest would be left without an answer.
    double fine = 1.1e-3;
  };
  Known known = {};
};

/// What would set all contacts right, as proximal_correction, with the same goal and work.
///
/// A step from impulses t finds the change d of the velocities with
///
///   M d = H (r(d) - r),   r(d) = P(t - rho (v + H^T d)),   rho: firmness / W_nn and firmness / W_tt,
///
/// P the projection on r_n >= 0 and then on the disc |r_t| <= mu r_n (Alart and Curnier 1991): contacts that
/// yield in proportion to what pushes them beyond t. Moments m of contacts that resist rolling are unknowns
/// likewise, with rho: firmness over 1/I_1 + 1/I_2, and |m| <= a r_n(d) (kernels/law/rolling_law.hpp). r(d)
/// is the next t; where d no longer changes the law holds. Newton's method solves it, by matrices M + H P'
/// rho H^T, which are not symmetric. Unlike the convex problem of proximal_newton.hpp it need not have one
/// solution, and a line search may come to a stop: then the step is taken back and made softer.
///
/// Contacts that press one another harder than they need, as those of grains that fell into a V, let go of it
/// by rho times a hair's breadth in a step. Between two changes of who sticks, slides or carries all such
/// steps are alike: the impulses leap to the first of those.
StepsCorrection coulomb_correction(const BodyProblem& problem, const ClusterGoal& goal,
                                   const CorrectionThresholds& thresholds, const CoulombThresholds& coulomb,
                                   double& work);

}  // namespace talus
