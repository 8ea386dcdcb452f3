#pragma once

/// The answer of a cluster by proximal steps, each of which Newton's method with a line search cannot fail to
/// solve: where rounds of an active set (correction.hpp) go in circles, as contacts carry more than they must
/// (docs/decisions/0024-certificate.md).

#include "kernels/clusters/step_search.hpp"

namespace talus {

/// Every number that proximal steps depend on. Ratios have no unit.
struct ProximalThresholds {
  /// A step is followed by a firmer one where it has taken at most `easy` factorisations, >= 0.
  SearchThresholds search{.first_firmness = 1e2, .most_steps = 200};
  int easy = 8;
  MinimumThresholds newton;
  /// As long as steps move by more than `far` goals, > 1, a minimum need not be known better than to this
  /// part of what the last step has moved, in (0, 1).
  double far = 100, loose = 0.1;
  /// Leaps of the impulses at most, >= 0. Each may double the largest one, until this is so many times that
  /// of the first step, >= 1.
  int most_leaps = 40;
  double most_growth = 100;
  /// Normal velocities of contacts that carry, over the fastest velocity there is, in (0, 1): less of it is
  /// rounding, as is less than ClusterGoal::still, and says nothing of who carries.
  double rounding = 1e-12;
};

/// What would set all contacts right, as correction_of. `work`: multiplications after which no more
/// factorisations begin, in; what is left of them, out. What is left and `open` are the same; settled:
/// further steps would change next to nothing.
///
/// The projections of a step (proximal_step.hpp) are the centres t of the next one, and its velocities make
/// the next shift s = mu |v_t|, none without friction. For given s steps come as near as need be to an answer
/// of that convex problem, one near the first t where redundant contacts leave several (Rockafellar 1976). s
/// follows the velocities (Cadoux 2009); with friction it need not settle.
StepsCorrection proximal_correction(const BodyProblem& problem, const ClusterGoal& goal,
                                    const CorrectionThresholds& thresholds,
                                    const ProximalThresholds& proximal, double& work);

}  // namespace talus
