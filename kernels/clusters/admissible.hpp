#pragma once

/// Whether a cluster can have an answer: walls that close on grains that cannot get away leave no velocities
/// with which no contact approaches, and no solver finds what there is not
/// (docs/decisions/0024-certificate.md).

#include "kernels/clusters/proximal_step.hpp"
#include "kernels/global/body_problem.hpp"

namespace talus {

/// Every number that the search depends on. Ratios have no unit.
struct AdmissibleThresholds {
  /// rho W_nn of the first proximal step; that of each further one is `growth`, > 1, times as large, up to
  /// `last_firmness`; and how many there are, at most, >= 1.
  double first_firmness = 1e2, growth = 1e2, last_firmness = 1e6;
  int most_steps = 10;
  MinimumThresholds newton;
  double inner = 1e-8;  ///< what momentum may be off by, over the scale, in (0, 1)
  /// Velocities are out of reach that are so many times what comes in and what drives, >> 1: a wedge or a
  /// chain asks for the inverse of its angle.
  double beyond = 1e5;
  /// After so many steps of `last_firmness` that do not raise the bound to this multiple, >= 1 and > 1, it is
  /// given up.
  int patience = 3;
  double rise = 5;
};

/// True where all admissible velocities, those with which no contact approaches by more than its bias allows,
/// are out of reach, and contacts have to approach by more than need not be told apart: by sum m |u| >
/// `enough` [N s], which walls that close by rounding do not. Friction adds no admissible velocities, so it
/// is left out. False says nothing. `work`: multiplications after which no more factorisations begin, in;
/// what is left of them, out. Not for problems with a cell.
///
/// For impulses f >= 0 along the normals, and admissible V, sum f (H^T V + b) >= 0, so that
///
///   |V|_M >= -f.b / |H f|_M^-1:
///
/// impulses that balance one another and do work against the bias prove it (Farkas), for whatever f. What
/// proximal steps of the problem without friction leave of approach tends to such impulses where there are
/// any (Banjac et al. 2019).
bool none_admissible(const BodyProblem& problem, double enough, const AdmissibleThresholds& thresholds,
                     double& work);

/// Whether friction may hold what walls close on, as a wedge does that is narrower than twice the angle of
/// friction. The same search, for velocities with which contacts that slide part by mu |v_t| at least, and
/// with impulses f in the cones, of which only the work sum f_n b_n of what closes counts. Where there are
/// such velocities Coulomb's law has an answer (Acary, Cadoux, Lemaréchal and Malick 2011); where there are
/// none it may have: true is a reason why none was found, no proof.
bool friction_may_lock(const BodyProblem& problem, double enough, const AdmissibleThresholds& thresholds,
                       double& work);

}  // namespace talus
