#pragma once

/// How far each contact of a step is from its law: what a mean over the sample hides.

#include <vector>

#include "kernels/global/body_parts.hpp"
#include "kernels/global/problem_reader.hpp"

namespace talus {

/// V = V_free + M^-1 H r. Collective.
PartField velocities_of(const ProblemReaders& parts, const PartLink& link);

/// Residuals of all contacts, relative to the step's velocities.
struct Residuals {
  /// Per part and contact: |r' - r| W_nn over `scale` [1], with r' one projection away from r (natural map,
  /// rho = 1/W_nn).
  std::vector<std::vector<double>> contact;
  /// Per part and unknown: the velocity u that all its contacts together would give it by r' - r, over
  /// `scale` [1].
  std::vector<std::vector<double>> body;
  /// The scale of error_rms: the larger of the root mean squares over the contacts of W_nn |r|, and of
  /// |v + b n| where they carry or close [m/s].
  double scale = 0;
};

/// The residuals of the problem's impulses and of the velocities that these give. Collective. Takes two
/// twists an unknown for a while, 96 bytes.
Residuals residuals_of(const ProblemReaders& parts, const PartLink& link);

/// The residual that a share `part` in (0, 1] of all contacts does not exceed [1], rounded up by at most 10
/// %. 0 without contacts. Collective.
double quantile_of(const Residuals& residuals, const PartLink& link, double part);

}  // namespace talus
