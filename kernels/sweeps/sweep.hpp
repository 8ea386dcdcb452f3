#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kernels/bodies/bodies.hpp"
#include "kernels/detection/contacts.hpp"

namespace talus {

/// A chunk's own instance of a wall. A wall of finite mass M touched by k chunks is split into k copies of
/// mass M/k, glued after each sweep (glue_copies). This is gluing inside one subdomain: without it all chunks
/// at a face of the sample would conflict.
struct WallCopy {
  double velocity[3]{};  ///< [m/s]
  double inv_mass{};     ///< k/M along the normal [1/kg]; 0 for a wall that is driven
};

/// Contacts [begin, end) of one chunk.
struct ContactRange {
  std::size_t begin;
  std::size_t end;
};

/// The last change of the impulses by sweeps with momentum, in the layout of Contacts: s - s_before [N s], s
/// the impulses after a sweep. Floats suffice, since their rounding is relative to the step and becomes small
/// with it.
struct SweepSteps {
  std::vector<float> x, y, z;  ///< with friction
  std::vector<float> n;        ///< without
};

/// A sweep that begins from s + beta (s - s_before) instead of s (momentum.hpp), and over-relaxes the normal
/// impulses by omega, in (0, 2). Friction is not over-relaxed, as it gains nothing by that. The velocities
/// have been moved to the start of the sweep already.
struct SweepMomentum {
  double beta = 0, omega = 1;
  SweepSteps& steps;  ///< read, and made anew
};

/// Sums of the certificate over some contacts. Add them in a fixed order only.
struct ErrorSums {
  double residual2 = 0;      ///< sum of e^2 [m^2/s^2]
  double residual_max2 = 0;  ///< max of e^2 [m^2/s^2]
  double impulse2 = 0;       ///< sum of (|r|/rho)^2 [m^2/s^2]
  double velocity2 = 0;      ///< sum of |v + b n|^2 over contacts that carry or close [m^2/s^2]
  double work = 0;           ///< sum of r_n |e| [J]
  double wall_impulse[3]{};  ///< sum of r at a wall, on the grains [N s]
  std::int64_t contacts = 0;
  std::int64_t active = 0;  ///< r_n > 0

  void add(const ErrorSums& other);
};

/// Replaces `count` vectors of three numbers, vector(k) the k-th, by their mean, summed in order. Copies of
/// equal masses keep their momentum so.
template <class At>
void glue_vectors(std::size_t count, const At& vector) {
  if (count == 0) return;
  double mean[3] = {0, 0, 0};
  for (std::size_t k = 0; k < count; ++k)
    for (int d = 0; d < 3; ++d) mean[d] += vector(k)[d];
  for (double& number : mean) number *= 1 / static_cast<double>(count);
  for (std::size_t k = 0; k < count; ++k)
    for (int d = 0; d < 3; ++d) vector(k)[d] = mean[d];
}

/// The same of the velocities of the copies `which` of one wall.
void glue_copies(std::span<WallCopy> copies, std::span<const std::int32_t> which);

/// Every number that damping depends on. Ratios have no unit.
struct DampingThresholds {
  /// A contact that a sweep has opened ends at 0 where W_nn |r| of what it carried is at most this part, in
  /// (0, 1), of the speed at which it opens: a part of it, and a part of that, would be a force for hundreds
  /// of steps.
  double faded = 1e-3;
};
inline constexpr DampingThresholds damping_thresholds;

/// Keeps a part of what a sweep changed: r <- before + part (r - before), and V with it. `before` holds the
/// impulses of the range (3 each, or 1 without friction). For a contact whose bodies stand in m_1 and m_2
/// subdomains part = 1/max(m_1, m_2): the damping that makes block Jacobi on full masses (Schwarz, (24))
/// converge, docs/decisions/0007-couplings.md.
template <bool Friction>
void relax(Contacts& contacts, ContactRange range, std::span<const double> before,
           Multiplicities multiplicity, std::span<Velocity> velocity, WallCopy* wall);

/// Copies the impulses of a range into `out`, as `relax` wants them.
template <bool Friction>
void copy_impulses(const Contacts& contacts, ContactRange range, std::vector<double>& out);

}  // namespace talus
