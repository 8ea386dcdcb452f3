#pragma once

/// A V = f over the bodies of all parts, A = M + H rho H^T.

#include <span>
#include <vector>

#include "kernels/global/body_parts.hpp"
#include "kernels/global/body_system.hpp"
#include "kernels/global/coarse_level.hpp"

namespace talus {

/// Conjugate gradients, preconditioned by one V-cycle: forward Gauss-Seidel within each part, the coarse
/// level of all, backward Gauss-Seidel. With several parts an iteration costs 4 sums over copies and 3
/// gathers, for 2 scalar products and the coarse level.
class BodySolver {
 public:
  /// Keeps a reference to `parts`. `rho` [kg] per part and contact; `aggregate`: grains per aggregate, 0:
  /// aggregate_target.
  BodySolver(const BodyParts& parts, std::span<const std::vector<double>> rho, int aggregate = 0);

  /// Starts from V. Returns z.A z of z, the preconditioned residual: an estimate from below of the squared
  /// error of V in the norm of A, which is at least the kinetic norm [J]. `f` and V hold the same bits for
  /// all copies of a body.
  double begin(const PartField& f, const PartField& V);
  /// One iteration, on the V that the last call left. Returns the same; 0 where rounding ends it.
  double iterate(PartField& V);
  /// Iterates until z.A z has fallen by the factor `tolerance` squared. Returns the number of iterations.
  int solve(const PartField& f, PartField& V, double tolerance, int max_iterations);

  /// f - A V of the last call, and that preconditioned: an estimate of the error of V.
  const PartField& residual() const { return residual_; }
  const PartField& preconditioned() const { return z_; }

 private:
  void multiply(const PartField& x, PartField& y) const;
  void precondition();

  const BodyParts& parts_;
  std::vector<BodySystem> systems_;
  CoarseLevel coarse_;
  double left_ = 0;
  PartField residual_, z_, direction_, product_, rest_;
};

}  // namespace talus
