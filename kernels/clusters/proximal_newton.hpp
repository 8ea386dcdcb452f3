#pragma once

/// The answer of a cluster by proximal steps, each of which Newton's method with a line search cannot fail to
/// solve: where rounds of an active set (correction.hpp) go in circles, as contacts carry more than they must
/// (docs/decisions/0024-certificate.md).

#include "kernels/clusters/correction.hpp"
#include "kernels/clusters/proximal_step.hpp"
#include "kernels/global/body_problem.hpp"

namespace talus {

/// Every number that proximal steps depend on. Ratios have no unit.
struct ProximalThresholds {
  /// rho W_nn of the first step; that of the next one is `growth`, > 1, times as large where a step has taken
  /// at most `easy` factorisations, up to CorrectionThresholds::firmness. Soft contacts find out who carries;
  /// firm ones leave little to mend.
  double first_firmness = 1e2, growth = 5;
  int easy = 8;
  /// A step that does not come to its minimum is taken back and tried again, softer by `growth`; the next
  /// `wary` steps, >= 0, get no firmer. Below `least_firmness`, > 0, the search ends.
  MinimumThresholds newton;
  int wary = 2;
  double least_firmness = 1;
  /// Momentum may be off by this part of the goal behind a step, in (0, 1).
  double inner = 1e-2;
  /// As long as steps move by more than `far` goals, > 1, a minimum need not be known better than to this
  /// part of what the last step has moved, in (0, 1).
  double far = 100, loose = 0.1;
  int most_steps = 200;  ///< >= 1
  /// No softer step settles, > 0: of directions that W hardly resists, as in a chain, it shows too little.
  double firm_enough = 1e6;
  /// What further steps would change, by how the last two did, may be so many goals, >= 1.
  double rest = 10;
};

/// What would set all contacts right, as correction_of. `work`: multiplications after which no more
/// factorisations begin, in; what is left of them, out. `enough`, the goal and `open` are the same; settled:
/// further steps would change next to nothing.
///
/// The projections of a step (proximal_step.hpp) are the centres t of the next one, and its velocities make
/// the next shift s = mu |v_t|, none without friction. For given s steps come as near as need be to an answer
/// of that convex problem, one near the first t where redundant contacts leave several (Rockafellar 1976). s
/// follows the velocities (Cadoux 2009); with friction it need not settle.
Correction proximal_correction(const BodyProblem& problem, double enough,
                               const CorrectionThresholds& thresholds, const ProximalThresholds& proximal,
                               double& work);

}  // namespace talus
