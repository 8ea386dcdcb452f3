#pragma once

/// The error of a step in velocities, wall forces and contact forces, per cluster of contacts: what the
/// residual of one contact cannot tell, in wedges, chains, arches and under heavy bodies
/// (docs/decisions/0024-certificate.md).

#include <algorithm>
#include <cmath>

#include "kernels/global/body_parts.hpp"
#include "kernels/global/correction.hpp"

namespace talus {

/// Every number that the estimates of this header depend on. Ratios have no unit.
struct StepErrorThresholds {
  CorrectionThresholds correction;
  /// Of the impulses between walls, in (0, 1): a cluster that does less is measured by this part of them; and
  /// of what all clusters do, per mass; and of the largest impulse of all, for those of its contacts.
  double interest = 1e-2;
  /// With friction an error above this, > 0, from rounds that have not settled says nothing.
  double nonsense = 1;
  /// What rounding leaves of the momentum of a cluster, over it, > 0: grains that fly side by side.
  double rounding = 1e-12;
};

/// Distance of what the impulses of a step give from the exact solution, relative.
struct StepError {
  double velocity = 0;  ///< of the worst cluster: sum m |V(r) - V*| over its scale
  double wall = 0;      ///< of the worst wall: its impulse, over the largest impulse of a wall
  double contact = 0;   ///< of the worst contact: its impulse, over the largest of its cluster
  Correction correction;

  double relative() const { return std::max({velocity, wall, contact}); }
};

/// How exactly an error is asked for.
struct ErrorGoal {
  double enough = 0;  ///< relative error that is not told apart from less
  double still =
      0;  ///< [m/s]: velocities that rounding of positions makes in gaps; slower bodies are at rest
};

/// Estimate of it, from a Newton step over all bodies (correction.hpp). Without friction and when the step
/// has settled, the velocities are exact but for what the linear solver leaves; elsewhere what is unsettled
/// counts as error.
///
/// With friction the step may not settle, and what it then finds can be any multiple of the error. There the
/// estimate of balance.hpp, which asks for one linear solve of the contacts as they are and has no rounds of
/// states, stands in for all three where they are above `nonsense`.
///
/// The scale of a cluster is sum m |V(r) - V_free|, what its contacts do, as far as what comes in explains
/// it; or the speed of driven walls times its mass, if that is more; where no wall is driven, at least a
/// hundredth (StepErrorThresholds::interest) of the impulses at walls, as grains pressed at rest gain
/// nothing; never less than a hundredth of what all clusters do, by its share of the mass, nor than what
/// rounding leaves of its own momentum.
StepError step_error(std::span<const BodyProblem> parts, const PartLink& link, const ErrorGoal& goal,
                     const StepErrorThresholds& thresholds = {});
/// The whole problem in one part.
StepError step_error(const BodyProblem& problem, const ErrorGoal& goal,
                     const StepErrorThresholds& thresholds = {});

}  // namespace talus
