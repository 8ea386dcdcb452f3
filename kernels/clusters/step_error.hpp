#pragma once

/// The error of a step in velocities, wall forces and contact forces, per group: bodies of a cluster that
/// push one another (loaded_groups.hpp). It is what the residual of one contact cannot tell, in wedges,
/// chains, arches and under heavy bodies (docs/decisions/0024-certificate.md).

#include <span>

#include "kernels/bodies/larger.hpp"
#include "kernels/clusters/cluster_solver.hpp"
#include "kernels/global/balance.hpp"
#include "kernels/global/body_parts.hpp"

namespace talus {

/// Every number that the estimates of this header depend on. Ratios have no unit.
struct StepErrorThresholds {
  ClusterThresholds cluster;
  /// Of the impulses between walls, in (0, 1): a cluster that does less is measured by this part of them.
  /// Small, as grains that friction jams between walls keep the forces of their landing: a ball of which the
  /// walls bear 10⁵ times its weight must still not rise.
  double pressed = 1e-8;
  /// Of what all clusters do, per mass, in (0, 1): one that does less is measured by this part of it, and the
  /// impulses of its contacts, too. What happens elsewhere in a step must not hide that a column at rest
  /// falls: a ball that hits the floor beside it at 5 m/s does 5000 times as much, per mass.
  double elsewhere = 1e-6;
  /// Of what cohesion holds a cluster together with, in (0, 1): one whose contacts do less, as they press as
  /// hard as they pull, is measured by this part of it.
  double held = 1e-6;
  /// Contacts without an impulse part a cluster into groups, unless under the answers of these they close
  /// with more than this part, in (0, 1), of what need not be told apart, and with more than rounding of
  /// positions makes (`still`). Small, as a nearly straight chain is moved by thousands of times what a
  /// contact of it closes by. In the so-many-th round of joining those that do, >= 1, what an answer of the
  /// whole cluster has carry joins, too, and in round twice that number all. Groups that have changed are
  /// answered anew in each round, each with its own budget.
  double closing = 1e-6;
  int most_rounds = 4;
  /// What rounding leaves of the momentum of a cluster, over it, > 0: grains that fly side by side.
  double rounding = BalanceThresholds{}.rounding;
  /// Of the momentum that rounding of positions makes of a cluster (ErrorGoal::still), in (0, 1]: what need
  /// not be told apart is this part of it at least. What a step may be wrong by is a few times that, and
  /// whoever compares velocities to rounding of positions has as much of his own.
  double still = 0.4;
  /// Heaviest over lightest body of a group, > 1, beyond which that momentum is not of all its mass, but what
  /// the answer changes by (felt_rounding.hpp).
  double lopsided = 100;
  /// Part of the scale of a group, in (0, 1): rounding that makes less is not looked at as closely as that.
  double slight = 1e-2;
  /// Least error, > 0, of a cluster without an answer: what rounds that did not settle have found says
  /// nothing of what they have not.
  double unknown = 1;
};

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
  bool solved = true;    ///< of all of those an answer was found
  bool jammed = false;   ///< of one of them there is none: walls close on grains that cannot get away
  bool locked = false;   ///< of one none was found, and it may be friction that holds its grains there
  Exchanged exchanged;   ///< by the contacts of all clusters

  /// The worst of all, NaN where one is.
  double relative() const { return larger(larger(velocity, wall), contact); }
};

/// How exactly an error is asked for.
struct ErrorGoal {
  double enough = 0;  ///< relative error that is not told apart from less
  int sweeps = 0;     ///< that the step has had: what answers may cost grows with them
  double still =
      0;  ///< [m/s]: velocities that rounding of positions makes in gaps; slower bodies are at rest
  double walls =
      0;  ///< [N s]: largest impulse of a wall, from all its contacts; more than from small clusters
  /// 1 over the edges along x, y, z of a cell, whose faces count as walls, 0 where none repeats: [1/m], or
  /// times d in a cell that follows a stress (ContactEquation::branch).
  Vec3 faces = Vec3::Zero();
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
