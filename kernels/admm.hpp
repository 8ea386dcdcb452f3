#pragma once

/// ADMM in body space: the solver for long chains and heavy bodies, where sweeps carry information one
/// contact at a time.

#include <cstdint>
#include <vector>

#include "kernels/body_problem.hpp"

namespace talus {

struct AdmmSettings {
  double tolerance = 1e-3;          ///< on momentum_defect and contact_defect
  double balance_tolerance = 2e-3;  ///< on balance_defect; where there are heavy bodies, this is enough
  int max_iterations = 100;
  double relaxation = 1.6;         ///< in [1, 2)
  double linear_tolerance = 0.05;  ///< of the conjugate gradients, on what is left of the residual
  int max_linear = 100;            ///< conjugate gradient iterations within one of ADMM
  int aggregate = 0;               ///< grains per aggregate; 0: aggregate_target
  double stiffness = 0;            ///< kappa; 0: estimate_stiffness
};

struct AdmmResult {
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

/// Improves `problem.impulse`, from which it starts. Alternating direction method of multipliers on
///
///   min 1/2 |V - V_free|_M^2 + indicator(y in K_mu*),   y = H^T V + c,   c = offset + mu |y_t| n
///
///   V  <- (M + H rho H^T)^-1 (M V_free + H (r + rho (y - c)))     conjugate gradients, coarse_level.hpp
///   x  <- a (H^T V + c) + (1 - a) y                               over-relaxation a
///   r' <- P_Kmu(r - rho x),   y <- x + (r' - r)/rho
///
/// with the De Saxce shift of the last y (Boyd et al. 2011; Acary et al. 2018 for the shift). rho = kappa /
/// W_nn: see `estimate_stiffness`. Deterministic, one thread.
AdmmResult solve_admm(BodyProblem& problem, const AdmmSettings& settings);

/// kappa of rho = kappa/W_nn from impulses that carry the load: sum W_nn r^2 / |M^-1/2 H r|^2, about the
/// inverse of the smallest eigenvalue of W that the load excites, in effective masses of a contact. A column
/// of N grains: N^2/3; a plate of T grain masses over L layers of c contacts: T L/c. 0 without impulses.
double stiffness_of(const BodyProblem& problem, std::span<const Vec3> impulse);

/// The same before any impulse is known: the momentum that stops every body at once is passed on, layer by
/// layer over the contacts, to the driven walls; or from the heaviest body outwards if there is none. Also
/// about the number of Gauss-Seidel sweeps that the problem needs. 0 without contacts.
double estimate_stiffness(const BodyProblem& problem);

}  // namespace talus
