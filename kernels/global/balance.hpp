#pragma once

/// Global balance: do the impulses carry what they must? The natural map measures one contact at a time; on
/// long chains and under heavy bodies each contact can be nearly satisfied while hardly anything of the load
/// is carried (docs/decisions/0012-stiff.md).

#include <algorithm>
#include <cmath>

#include "kernels/global/body_parts.hpp"

namespace talus {

/// Parameters of the estimates of this header, besides the accuracy that the caller asks for. Ratios have no
/// unit; iterations are those of conjugate gradients.
struct BalanceThresholds {
  /// Where changes still grow nothing has settled: then so many times the last change is taken to come, >= 1.
  double unsettled = 20;
  /// A contact slides when its tangential impulse is within this part of mu r_n, in (0, 1).
  double sliding = 1e-6;
  /// rho W_nn over estimate_stiffness, >> 1. That estimate looks at masses and layers only: in a wedge of
  /// half angle a the load excites an eigenvalue smaller by sin^2 a.
  double firmness = 1e4;
  /// Error of the conjugate gradients over the motion that they have found, at which they stop, in (0, 1).
  double linear_tolerance = 0.25;
  /// Iterations of a linear solve, at most, >= 1.
  int most_linear = 128;
  /// From so many iterations on, >= 1, their last changes give an estimate of the change still to come.
  int few_linear = 16;
  /// Linear solves, at most, >= 1: before each further one, open contacts join those that carry.
  int most_rounds = 6;
  /// Factor on the bound of the conjugate gradients, >= 1: that is of a preconditioned residual, which is
  /// smaller than the error.
  double caution = 3;
  /// Part of the impulses at walls, in (0, 1), that an error is compared with at least where no wall is
  /// driven. It is what a reader of the results cares for, and the check of the work of
  /// errors (CertificateThresholds) reads it here.
  double interest = 1e-2;
  /// Groups whose stiffness is estimated one by one, >= 1; others have one estimate together.
  int most_groups = 16;
  /// What rounding leaves of the momentum of the sample, or of a small cluster, over it, > 0: the least scale
  /// of grains that fly side by side.
  double rounding = 1e-12;
};

/// The change still to come if changes go on as they did: the larger of `change`, over the second half of the
/// sweeps, and its extrapolation from the change `before`, over the second quarter. An error that decays as
/// exp(-k/t) changes by s (1 + s) as much over the second half as over the quarter before, with s =
/// exp(-n/4t); what is left is s^2/(1 - s^2) of the last change. Where changes still grow nothing has
/// settled, and `unsettled` times the change is taken (BalanceThresholds).
inline double left_over(double change, double before, double unsettled = BalanceThresholds{}.unsettled) {
  if (!(change < 2 * before)) return unsettled * change;
  const double s = (std::sqrt(1 + 4 * change / before) - 1) / 2;
  return change * std::clamp(s * s / (1 - s * s), 1.0, unsettled);
}

/// Estimate of the relative error of the forces that the walls carry, from their relative `change` over the
/// second half of `sweeps` sweeps in a problem that takes about `sweeps_needed` of them (estimate_stiffness).
/// A quantity that converges in k sweeps changes by about half of its error over k/2 sweeps, and over fewer
/// sweeps by proportionally less. So a plate that the sweeps let fall seems to be at rest: 10^6 grain masses
/// on a pile, k = 8e4; after 1000 sweeps the force is 0.7 % of the weight, its change 0.5, and the estimate
/// 80.
inline double unbalance(double change, int sweeps, double sweeps_needed) {
  if (sweeps == 0 || sweeps >= sweeps_needed) return change;
  return change * std::max(1.0, 2 * sweeps_needed / sweeps);
}

/// Distance of the velocities that a step's impulses give from those of the exact solution.
struct VelocityError {
  double relative = 0;        ///< sum m |V(r) - V*| over the scale of the step
  int linear_iterations = 0;  ///< conjugate gradients
};

/// Estimates this error from the impulses of the problem, whose contacts it uses up. `enough`: what need not
/// be known more exactly. The error is the momentum that bodies have still to gain or lose: force carried
/// against force due, for every wall, every heavy body and through every cut of the sample. It is measured as
/// sum m |u| + (I/R^2) |w|.
///
/// Each contact asks for the change y - v of its velocity, with (r', y) the complementary pair next to (r,
/// v), one projection away. Without friction, and with r and y complementary, a motion d of the bodies bounds
/// the error if it gives those that carry what they ask for, H^T d = y - v, and closes the others at most:
///
///   |V(r) - V*|_M^2 = (r - r*).(v - v*) <= (r - r*).(v - y) = -d.M (V(r) - V*) <= |d|_M |V(r) - V*|_M
///
/// since (r - r*).(y - v*) = -r.v* - r*.y <= 0. The smallest such motion is sought: min |d|_M^2 + sum rho
/// |H^T d - (y - v)|^2 over the contacts that carry, along the normal where they slide, with rho far above
/// what the problem needs. That is a linear solve (body_solver.hpp), which converges on chains where sweeps
/// do not. Open contacts that d would push in are added, and the system is solved again. Changes that no
/// motion can give, as for a grain between driven walls that close, count in full. Heuristic are friction,
/// the finite rho and number of rounds, and that the momentum of d, of which the kinetic norm is bounded, is
/// taken for that of the error.
///
/// The scale is the largest of three. First, sum m |V(r) - V_free|, what the contacts do, but no more than
/// what comes in can explain. Second, the speed of driven walls times the whole mass; where no wall is
/// driven, a hundredth (BalanceThresholds::interest) of the impulses at walls, as grains pressed at rest gain
/// nothing. Third, what rounding leaves of the sample's own momentum. The estimate takes about as long as a
/// hundred sweeps. With several groups error and scale are those of each, and the worst is returned.
VelocityError velocity_error(std::span<BodyProblem> parts, const PartLink& link, double enough,
                             const BodyGroups& groups = {}, const BalanceThresholds& thresholds = {});
/// The whole problem in one part.
VelocityError velocity_error(BodyProblem problem, double enough, const BalanceThresholds& thresholds = {});

}  // namespace talus
