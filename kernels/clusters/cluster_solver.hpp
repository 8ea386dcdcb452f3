#pragma once

/// The exact answer of one small cluster, next to the impulses that it has: what its error is measured by,
/// and what mends it (docs/decisions/0024-certificate.md).

#include <array>
#include <cstdint>
#include <vector>

#include "kernels/clusters/correction.hpp"
#include "kernels/global/body_problem.hpp"

namespace talus {

/// Every number that an answer depends on. Ratios have no unit.
struct ClusterThresholds {
  CorrectionThresholds correction;
  /// Scaled errors (kernels/delassus/delassus.hpp) at which the solver with the stored matrix hands over to
  /// Newton rounds again, > 0, falling; and its iterations until then, at most, >= 1.
  struct Turn {
    double residual;
    std::int64_t most_iterations;
  };
  std::array<Turn, 3> turns{{{1e-6, 300}, {1e-8, 1000}, {1e-11, 3000}}};
};

/// What a cluster's impulses have to change by. Momenta are sum m |u| + (I/R^2) |w| [N s].
struct ClusterAnswer {
  std::vector<Vec3> impulse;  ///< per contact: change of r [N s]
  std::vector<Twist> motion;  ///< per unknown: change of V [m/s]
  double error = 0;           ///< momentum of the motion, and what is not known of it [N s]
  bool solved = false;        ///< impulses and velocities satisfy the law but for what is small
  bool helps = false;         ///< with the change they are nearer to it than before
};

/// Rounds of Newton's method over the bodies (correction.hpp); with friction, where these do not settle, the
/// solvers that keep W (kernels/delassus/delassus_auto.hpp) from the impulses that it has, and rounds again
/// from there. `enough`: momentum [N s] that need not be told apart. All by counted work, so the same bits
/// come out every time. The changed impulses lie on the cones. Values that are not finite come back as an
/// error that is not.
ClusterAnswer solve_cluster(const BodyProblem& problem, double enough,
                            const ClusterThresholds& thresholds = {});

}  // namespace talus
