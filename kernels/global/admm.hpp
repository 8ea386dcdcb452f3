#pragma once

/// ADMM in body space: the solver for long chains and heavy bodies, where sweeps carry information one
/// contact at a time.

#include <cstdint>
#include <vector>

#include "kernels/global/body_parts.hpp"
#include "kernels/global/stiffness.hpp"

namespace talus {

struct BodyAdmmSettings {
  double tolerance = 1e-3;          ///< on momentum_defect and contact_defect
  double balance_tolerance = 1e-3;  ///< on balance_defect; enough by itself where there are heavy bodies
  int max_iterations = 100;
  double relaxation = 1.6;         ///< in [1, 2)
  double linear_tolerance = 0.05;  ///< of the conjugate gradients: what they leave of the residual, relative
  int max_linear = 100;            ///< conjugate gradient iterations within one of ADMM
};

struct BodyAdmmResult {
  int iterations = 0;
  int linear_iterations = 0;   ///< conjugate gradients, all
  double momentum_defect = 0;  ///< |V - V_free - M^-1 H r| / |V - V_free|, kinetic norms
  double contact_defect = 0;   ///< contact velocities against the law, over the rms change of velocity
  /// Force carried against force due: the same as momentum_defect for the worst of the heavy bodies; where
  /// there are none, for the momentum of the whole sample. The worst of the last 8 iterations.
  double balance_defect = 0;
  double stiffness = 0;  ///< kappa: rho over the effective mass of a contact
  bool converged = false;
};

/// Improves the impulses, from which it starts. Alternating direction method of multipliers on
///
///   min 1/2 |V - V_free|_M^2 + indicator(y in K_mu*),   y = H^T V + c,   c = offset + mu |y_t| n
///
///   V  <- (M + H rho H^T)^-1 (M V_free + H (r + rho (y - c)))     conjugate gradients, body_solver.hpp
///   x  <- a (H^T V + c) + (1 - a) y                               over-relaxation a
///   r' <- P_Kmu(r - rho x),   y <- x + (r' - r)/rho
///
/// with the De Saxce shift of the last y (Boyd et al. 2011; Acary et al. 2018 for the shift). rho = kappa /
/// W_nn: see `estimate_stiffness`. If masses are so large, so small or so far apart that some rho does not
/// fit a double, the impulses stay as they are, not converged. The result has the same bits wherever the
/// parts lie.
BodyAdmmResult solve_admm(std::span<BodyProblem> parts, const PartLink& link,
                          const BodyAdmmSettings& settings);
/// The whole problem in one part.
BodyAdmmResult solve_admm(BodyProblem& problem, const BodyAdmmSettings& settings);

}  // namespace talus
