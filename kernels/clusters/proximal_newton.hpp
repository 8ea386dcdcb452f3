#pragma once

/// The answer of a cluster without friction by proximal steps, each of which Newton's method with a line
/// search cannot fail to solve: where rounds of an active set (correction.hpp) go in circles, as contacts
/// carry more than they must (docs/decisions/0024-certificate.md).

#include "kernels/clusters/correction.hpp"
#include "kernels/global/body_problem.hpp"

namespace talus {

/// Every number that proximal steps depend on. Ratios have no unit.
struct ProximalThresholds {
  /// rho W_nn of the first step, and by how much that of each further one is larger, > 1, up to
  /// CorrectionThresholds::firmness. Soft contacts find out who carries; firm ones leave nothing to mend.
  double first_firmness = 1e3, growth = 100;
  /// Momentum may be off by this part of the goal behind a step, in (0, 1).
  double inner = 1e-2;
  /// A step of Newton's method may go beyond the minimum along its way until the slope is this part of the
  /// first one, in (0, 1); and how well the minimum is found where it goes further, likewise.
  double slope = 0.1, line = 0.1;
  /// Factorisations of all steps together, at most, >= 1.
  int most_factorisations = 200;
  /// Steps, at most, >= 1; and factorisations that have not halved what momentum is off by, after which
  /// nothing but rounding is left of it.
  int most_steps = 20, patience = 12;
};

/// What would set all contacts right, as correction_of: `enough`, the goal and what counts as settled are the
/// same. No contact has friction.
///
/// A step from impulses t >= 0 finds the change d of the velocities that makes
///
///   1/2 |d|_M^2 + r.H^T d + sum 1/(2 rho) max(0, t - rho (v_n + b + n.H^T d))^2
///
/// least, which is strictly convex and smooth; max(0, ...) are the next t. They come as near as need be to an
/// answer, one near the first t where redundant contacts leave several (Rockafellar 1976).
Correction proximal_correction(const BodyProblem& problem, double enough,
                               const CorrectionThresholds& thresholds, const ProximalThresholds& proximal);

}  // namespace talus
