#pragma once

/// The answer of a cluster with friction by proximal steps that are Coulomb's law as it is: friction follows
/// the normal impulse, and its direction the slip, within a step, where those of proximal_newton.hpp follow
/// from one step to the next. Jammed grains, whose sliding contacts creep there by hundreds of steps or go to
/// and fro, are solved by it (docs/decisions/0024-certificate.md).

#include "kernels/clusters/correction.hpp"
#include "kernels/global/body_problem.hpp"

namespace talus {

/// Every number that these steps depend on. Ratios have no unit.
struct CoulombThresholds {
  /// rho W_nn of the first step. Where a step leaves more than `slow`, in (0, 1), of what the law found wrong
  /// before, the next one is `growth`, > 1, times as firm, up to CorrectionThresholds::firmness. A step whose
  /// problem is not solved is taken back and tried again, softer by `growth`, and the next `wary` steps, >=
  /// 0, get no firmer. Below `least_firmness`, > 0, the search ends.
  double first_firmness = 1e3, growth = 5, slow = 0.3, least_firmness = 1;
  int wary = 2;
  int most_steps = 400;  ///< >= 1
  /// Momentum may be off by this part of the goal behind a step, or of what the law found wrong before it;
  /// and by so much more of the latter where nothing makes it less, all in (0, 1).
  double inner = 1e-2, loose = 0.1;
  /// Of Newton's method within a step: iterations; halvings of one; and the part of an iteration's length
  /// by which it has to make the residual smaller, in (0, 1).
  int most_iterations = 25, halvings = 5;
  double descent = 0.1;
  /// No softer step settles, > 0, and what further steps would change, by how the last two did, may be so
  /// many goals, >= 1: as those of ProximalThresholds.
  double firm_enough = 1e6, rest = 10;
};

/// What would set all contacts right, as proximal_correction, with the same goal and work.
///
/// A step from impulses t finds the change d of the velocities with
///
///   M d = H (r(d) - r),   r(d) = P(t - rho (v + H^T d)),   rho: firmness / W_nn and firmness / W_tt,
///
/// P the projection on r_n >= 0 and then on the disc |r_t| <= mu r_n (Alart and Curnier 1991): contacts that
/// yield in proportion to what pushes them beyond t. r(d) is the next t; where d no longer changes the law
/// holds. Newton's method solves it, by matrices M + H P' rho H^T, which are not symmetric. Unlike the convex
/// problem of proximal_newton.hpp it need not have one solution, and a line search may come to a stop: then
/// the step is taken back and made softer.
Correction coulomb_correction(const BodyProblem& problem, double enough,
                              const CorrectionThresholds& thresholds, const CoulombThresholds& coulomb,
                              double& work);

}  // namespace talus
