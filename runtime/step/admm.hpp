#pragma once

#include <vector>

#include "kernels/admm.hpp"
#include "runtime/graph/communicator.hpp"
#include "runtime/step/state.hpp"

namespace talus {

/// ADMM (kernels/admm.hpp) on the contacts of a step, whatever subdomains this rank's copies stand in: a body
/// is one unknown, its mass whole. On one rank; on several `available` is false and nothing is called.
///
///   between two epochs, on one thread:  admm.improve();  next epoch: V afresh from r, then sweeps
class Admm {
 public:
  /// Keeps references.
  Admm(StepState& state, const StepParameters& parameters, const DecompositionSettings& decomposition,
       const graph::Communicator& ranks);

  bool available() const { return ranks_.ranks() == 1; }

  /// About the number of Gauss-Seidel sweeps that the problem needs: estimate_stiffness.
  double sweeps_needed() const;

  /// Relative error of the velocities that the impulses give (kernels/balance.hpp); what is below `enough` is
  /// not told apart. Velocities are not read.
  double velocity_error(double enough) const;

  /// Replaces the impulses of `state.contacts` by better ones, their balance a tenth of `tolerance` or
  /// better. Velocities are left to be made afresh. `calls` before in this step: each is to be four times as
  /// exact as the last, as that was not enough.
  BodyAdmmResult improve(double tolerance, int calls);

 private:
  BodyProblem gather() const;

  StepState& state_;
  const StepParameters& parameters_;
  const DecompositionSettings& decomposition_;
  const graph::Communicator& ranks_;
};

}  // namespace talus
