#pragma once

/// A V = f over the bodies of all parts, A = M + H rho H^T.

#include <span>
#include <vector>

#include "kernels/global/body_parts.hpp"
#include "kernels/global/body_system.hpp"
#include "kernels/global/coarse_level.hpp"

namespace talus {

/// Conjugate gradients, preconditioned by one V-cycle: forward Gauss-Seidel within each part, the coarse
/// level of all, backward Gauss-Seidel. Of an iteration, with several parts: 4 sums over copies, and the rows
/// of 2 scalar products and of the coarse level gathered.
class BodySolver {
 public:
  /// Keeps a reference to `parts`. `rho` [kg] per part and contact; `aggregate`: grains per aggregate, 0:
  /// aggregate_target.
  BodySolver(const BodyParts& parts, std::span<const std::vector<double>> rho, int aggregate = 0);

  /// From V on, or from 0 where V is. Returns z.A z of z, the preconditioned residual: about the square of
  /// the error of V in the norm of A, and at most that; this norm is no smaller than the kinetic one [J]. `f`
  /// and V hold the same bits for all copies of a body.
  double begin(const PartField& f, const PartField& V);
  /// One iteration, on the V that the last call left. Returns the same; 0 where rounding ends it.
  double iterate(PartField& V);
  /// Until that is `tolerance` squared of what it was. Returns the number of iterations.
  int solve(const PartField& f, PartField& V, double tolerance, int max_iterations);

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
