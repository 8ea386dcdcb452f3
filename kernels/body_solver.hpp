#pragma once

/// (M + H rho H^T) V = f over bodies by conjugate gradients: what ADMM iterates with, and what measures how
/// far a step's velocities are from their answer (balance.hpp).

#include <span>
#include <vector>

#include "kernels/body_system.hpp"
#include "kernels/coarse_level.hpp"

namespace talus {

/// Preconditioned by one V-cycle: forward Gauss-Seidel, the coarse level, backward Gauss-Seidel.
///
///   for (double left = solver.begin(f, V); left > goal;) left = solver.iterate(V);
class BodySolver {
 public:
  /// Keeps a reference to `problem`. `rho` [kg]: one per contact, > 0. `aggregate`: grains per aggregate.
  BodySolver(const BodyProblem& problem, std::span<const double> rho, int aggregate);

  /// From V on. Returns z.A z of z, the preconditioned residual: about the square of the error of V in the
  /// norm of A, and at most that; A is M + H rho H^T, so this norm is no smaller than the kinetic one [J].
  double begin(std::span<const Twist> f, std::span<Twist> V);
  /// One iteration, on the V that the last call left. Returns the same; 0 where rounding ends it.
  double iterate(std::span<Twist> V);

 private:
  double precondition();

  Aggregates aggregates_;
  BodySystem system_;
  CoarseLevel coarse_;
  double left_ = 0;
  std::vector<Twist> residual_, z_, direction_, product_, rest_;
};

}  // namespace talus
