#pragma once

/// The error of a step in velocities, wall forces and contact forces, per group: bodies of a cluster that
/// push one another (loaded_groups.hpp). It is what the residual of one contact cannot tell, in wedges,
/// chains, arches and under heavy bodies (docs/decisions/0024-certificate.md).

#include <span>

#include "kernels/bodies/larger.hpp"
#include "kernels/clusters/answer_state.hpp"
#include "kernels/clusters/step_error_goal.hpp"
#include "kernels/global/body_parts.hpp"

namespace talus {

/// Distance of what the impulses of a step give from a solution of it, relative.
struct StepError {
  double velocity = 0;  ///< of the worst group: sum m |V(r) - V*| over its scale
  /// Of the worst wall: its impulse, over the largest impulse of a wall, or what rounding or other groups
  /// (StepErrorThresholds::elsewhere) make of the momentum of a group that changes one; the faces of a cell
  /// are walls.
  double wall = 0;
  double contact = 0;    ///< of the worst contact: its impulse, over the largest of its group
  PartImpulses change;   ///< of r, per part and contact, that mends it as far as answers help [N s]
  PartImpulses moments;  ///< likewise of moments of rolling resistance [N m s]
  bool mends = false;    ///< of clusters that are wrong by more than what is asked for it mends some
  AnswerState worst = AnswerState::found;  ///< what speaks most against an answer of one of those
  Exchanged exchanged;                     ///< by the contacts of all clusters

  /// The worst of all, NaN where one is.
  double relative() const { return larger(larger(velocity, wall), contact); }
};

/// The distance to an answer of every group (cluster_solver.hpp); the clusters must be small. Without
/// friction velocities are unique, and this is their error but for rounding. With friction they may not be:
/// there it is the distance to one of the solutions, and that to the nearest is no larger. Where no answer is
/// found the error is not known, and at least StepErrorThresholds::unknown. Collective.
///
/// The scale of a group is sum m |V(r) - V_free|, what its contacts do, with cohesion and moments, as far as
/// what comes in explains it; or the speed of driven walls times its mass, if that is more; where no wall is
/// driven, at least what StepErrorThresholds::pressed says of the impulses at walls, as grains pressed at
/// rest gain nothing; never less than a millionth (StepErrorThresholds::elsewhere) of what all clusters
/// do, by its share of the mass, nor of what cohesion holds it with, nor than what rounding leaves of its own
/// momentum, and where it is not lopsided of that of all its mass.
StepError step_error(std::span<const BodyProblem> parts, const PartLink& link, const ErrorGoal& goal,
                     const StepErrorThresholds& thresholds = {});
/// The whole problem in one part.
StepError step_error(const BodyProblem& problem, const ErrorGoal& goal,
                     const StepErrorThresholds& thresholds = {});

}  // namespace talus
