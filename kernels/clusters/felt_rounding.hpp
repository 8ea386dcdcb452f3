#pragma once

/// What rounding of positions makes of bodies that push one another.

#include <cstddef>
#include <vector>

#include "kernels/clusters/cluster_solver.hpp"

namespace talus {

/// Of each body and contact, or empty, and then nothing.
struct FeltRounding {
  std::vector<double> momentum, impulse;  ///< [N s]

  double all_momentum() const;
  /// What is left of a change of a contact's impulse [N s].
  double beyond(std::size_t contact, double change) const;
  /// The part of a motion that is rounding [N s]: of each body no more than it moves by.
  double part_of_motion(const BodyProblem& problem, const std::vector<Twist>& motion) const;
};

/// Whether some body is more than so many `times` as heavy as another.
bool lopsided(const BodyProblem& problem, double times);

/// How far the answer to a problem goes when its gaps differ by rounding, which changes velocities by
/// goal.still. Where one body is far heavier than another the momentum of all of them at that speed would
/// hide whatever the light ones do: a heavy body that they touch, and do not hold, adds nothing to it. Of a
/// body no more than its own momentum at that speed.
/// `goal`: how exactly answers are to be known; of those that are not found nothing is taken.
FeltRounding felt_rounding(const BodyProblem& problem, const ClusterGoal& goal,
                           const ClusterThresholds& thresholds = {});

}  // namespace talus
