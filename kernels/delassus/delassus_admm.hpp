#pragma once

#include <span>

#include "kernels/delassus/delassus.hpp"

namespace talus {

struct AdmmSettings {
  double penalty = 0.1;          ///< first rho, in units of trace(W_cc)/3, > 0; adapted on the way
  double over_relaxation = 1.6;  ///< 1 to 1.9
};

/// Alternating direction method of multipliers on the stored W (Boyd et al. 2011; for friction Acary, Bremond
/// and Huber 2018), in variables that make trace(W_cc)/3 = 1:
///     (W + rho I) r = rho z - lambda - q - mu |lambda_T| n,   z = P_K(r^ + lambda/rho),   lambda += rho (r^
///     - z)
/// with r^ = 1.6 r - 0.6 z; lambda -> -(u + mu |u_T| n), so the De Saxce term lags one iteration. W + rho I
/// is factorised once, and again when rho must change: by LDL' when W is symmetric to rounding, by LU when
/// not. Sees through long chains, which sweeps do not; many cheap iterations where Newton has few dear ones.
DelassusReport solve_admm(const DelassusProblem& problem, const DelassusGoal& goal,
                          const AdmmSettings& settings, std::span<double> r);

}  // namespace talus
