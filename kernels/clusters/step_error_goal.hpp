#pragma once

/// What is asked of the error of a step (step_error.hpp), and by which thresholds it is found.

#include "kernels/clusters/cluster_solver.hpp"
#include "kernels/global/balance.hpp"

namespace talus {

/// Every number that errors of groups depend on. Ratios have no unit.
struct StepErrorThresholds {
  ClusterThresholds cluster;
  /// Of the impulses between walls, in (0, 1): a cluster that does less is measured by this part of them.
  /// Small, as grains that friction jams between walls keep the forces of their landing: of a ball that
  /// presses them with 10⁵ times its weight it is a thousandth of that; not 0, as grains pressed at rest
  /// between walls do nothing else, and rounding leaves 10⁻¹⁶ of these forces.
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
  /// ... where what rounding makes of all its mass, over what is asked for, is more than this part, in (0,
  /// 1), of the scale of the group: less changes no verdict.
  double slight = 1e-2;
  /// Least error, > 0, of a cluster without an answer: what rounds that did not settle have found says
  /// nothing of what they have not.
  double unknown = 1;
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

}  // namespace talus
