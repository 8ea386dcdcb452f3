#pragma once

/// How far the impulses of a step are from those that solve it: one step of an active-set Newton method over
/// all bodies, by linear solves that see through chains where sweeps do not
/// (docs/decisions/0024-certificate.md).

#include <cstdint>
#include <span>
#include <vector>

#include "kernels/global/body_parts.hpp"
#include "kernels/global/clusters.hpp"

namespace talus {

/// Every number that a correction depends on. Ratios have no unit.
struct CorrectionThresholds {
  /// rho W_nn in the linear systems, >> 1.
  double firmness = 1e9;
  /// Updates of the multipliers in a round, at most, >= 1.
  int most_updates = 8;
  /// What a part may leave: this part of what was found, or of what need not be known more exactly, in (0,
  /// 1).
  double tolerance = 0.1;
  /// Conjugate gradients of a linear system, at most, >= 1. They only mend what rounding leaves of the direct
  /// solve, and walls of finite mass on single grains.
  int most_linear = 16;
  /// From so many iterations on, >= 1, the way they went tells how far they have still to go.
  int few_linear = 8;
  /// Where changes still grow nothing has settled: so many times the last one is still to come, >= 1.
  double unsettled = 20;
  /// Rounds, at most, >= 1: before each further one contacts open, close, stick or slide.
  int most_rounds = 12;
  /// Rounds that have not made the error smaller, after which no more follow, >= 1.
  int patience = 3;
  /// Factor on the gradients' bound, >= 1: they see a preconditioned residual, which is smaller than the
  /// error.
  double caution = 3;
};

/// What would set all contacts right, and how well that is known. Momenta are sum m |u| + (I/R^2) |w|.
struct Correction {
  PartField velocity;    ///< V(r) of the impulses as they are [m/s]
  PartField motion;      ///< change of V [m/s]
  PartImpulses impulse;  ///< change of r, per part and contact [N s]
  Clusters clusters;
  /// Per cluster [N s]: `found`, momentum of the motion; `missed`, wishes of contacts that the motion does
  /// not grant; `open`, impulses that would pull and approaches that the last round has left; `left`, what
  /// the linear solver has.
  enum Row { found, missed, open, left, width };
  ClusterRows errors;
  int rounds = 0, linear_iterations = 0;
  bool settled = false;  ///< no contact changed its state any more, but for what is small

  /// Of a cluster, all of it.
  double error(std::size_t part, std::int32_t cluster) const {
    const std::span<const double> row = errors.of(part, cluster);
    return row[found] + row[missed] + row[open] + row[left];
  }
};

/// The Newton step from the impulses of `parts`. `enough`: per part and cluster the momentum [N s] below
/// which an error need not be known.
///
/// Each contact is put where the natural map sees it: open, sliding along a given direction, or sticking.
/// With the wishes w = y - v of those that carry (y = 0 where b = 0; without friction along the normal only)
///
///   min 1/2 |d|_M^2 - k.d,   H^T d = w,   change of r = multipliers,   k: what is known, such as -r of those
///                                                                       that open
///
/// is solved by augmented Lagrangians: (M + H rho H^T) d = k + H (rho w + s), s += rho (w - H^T d). Contacts
/// whose impulse would pull then open, and open ones that d closes join, and it is solved again. When no
/// contact changes any more, and without friction, V + d is the exact solution of the step, since it and r +
/// change satisfy all its conditions. With friction the direction of sliding is that of the last velocities.
Correction correction_of(std::span<const BodyProblem> parts, const PartLink& link,
                         const std::vector<std::vector<double>>& enough, const Clusters& clusters,
                         const CorrectionThresholds& thresholds = {});

/// Sum m |u| + (I/R^2) |w| of a field per cluster: column 0 of the rows [N s].
ClusterRows momentum_of_clusters(const BodyParts& parts, const Clusters& clusters, const PartField& motion);

}  // namespace talus
