#pragma once

/// Groups of a cluster whose bodies push one another, each with its answer and what its errors are compared
/// with.

#include <vector>

#include "kernels/clusters/felt_rounding.hpp"
#include "kernels/clusters/loaded_groups.hpp"
#include "kernels/clusters/step_error_goal.hpp"

namespace talus {

struct AnsweredGroup {
  LoadedGroup group;
  ClusterAnswer answer;
  double scale = 0;        ///< what its errors are compared with [N s]
  double exchanged = 0;    ///< likewise if nothing were driven: by that forces have to be known
  double floor = 0;        ///< what is done elsewhere makes of that [N s]
  double noise = 0;        ///< what rounding leaves of its momentum [N s]
  double at_wall = 0;      ///< likewise of a wall's impulse
  bool lopsided = false;   ///< what rounding makes of all its mass would hide its light bodies
  FeltRounding felt = {};  ///< of its bodies and contacts then
};

/// What the contacts of all clusters do: a floor for each.
struct Everywhere {
  double scale = 0;  ///< [N s]
  double mass = 0;   ///< [kg]
};

/// The groups of a cluster and their answers, such that no contact between two closes by more than may be
/// (StepErrorThresholds::closing). Contacts that carry nothing, neither now nor in the answers, join none.
std::vector<AnsweredGroup> answered_groups(const BodyProblem& cluster, const Everywhere& everywhere,
                                           const ErrorGoal& goal, const StepErrorThresholds& thresholds);

}  // namespace talus
