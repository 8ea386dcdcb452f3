#pragma once

/// What the kernels of every instruction set are called with: plain pointers, so that their translation units
/// include no header whose inline functions could be kept in a version for the wrong processor.

#include <cstddef>
#include <cstdint>

namespace talus {

inline constexpr std::size_t group_size = 16;  ///< contacts of a full group

/// Contacts [begin, end) of one chunk, arrays as in `Contacts`.
template <class Number>
struct ContactViewOf {
  const Number *nx, *ny, *nz, *bias;
  const Number *rx, *ry, *rz;           ///< with friction
  const Number* rn;                     ///< without
  const Number* mu;                     ///< where each contact has friction of its own
  const Number *vx, *vy, *vz;           ///< drifts, or null
  const Number* reach;                  ///< in a cell under stress, else void
  const std::uint32_t *first, *second;  ///< where the records of the bodies begin, in numbers
  const std::uint8_t* group;  ///< sizes of the groups from `begin` on, each 1..16: no grain twice in one
  std::size_t begin, end;
  bool far;  ///< prefetch bodies: their records exceed the first cache of a core
};

using ContactView = ContactViewOf<double>;
using SingleContactView = ContactViewOf<float>;  ///< arrays as in `SingleContacts`

/// The impulses of a contact view, where they are written.
template <class Number>
struct ImpulseViewOf {
  Number *x, *y, *z;  ///< with friction
  Number* n;          ///< without
};
using ImpulseView = ImpulseViewOf<double>;
using SingleImpulseView = ImpulseViewOf<float>;

/// SweepMomentum, its steps in the layout of `ImpulseView`.
struct MomentumView {
  float *x, *y, *z;  ///< with friction
  float* n;          ///< without
  double beta, omega;
};

/// Sums of the error as in `ErrorSums`.
struct ErrorTotals {
  double residual2, residual_max2, impulse2, velocity2, work;
  double wall_impulse[3];
  std::int64_t active;
};

/// A wall, or a chunk's copy of it.
struct WallView {
  double* velocity;  ///< 3 [m/s]
  double inv_mass;   ///< [1/kg]
};

/// A cell under stress, or a chunk's copy of it: xx, yy, zz, xy, xz, yz.
struct CellView {
  double* velocity;        ///< 6 [m/s]
  const double* inv_mass;  ///< 6 [1/kg]
};

/// Of which copies a wall's error is asked, and in how many parts the bodies stand.
struct WholeView {
  const double* wall;          ///< its velocity, 3 [m/s]
  double wall_inv_mass;        ///< that of the whole wall [1/kg]
  const std::uint16_t* parts;  ///< per body, or null
};

/// `bodies` are records of 8 numbers: u(3), 1/m, w(3), R^2/I. `mu` is the friction of all contacts of the
/// chunk; kernels for chunks whose contacts have friction of their own do not read it.
struct LaneKernels {
  void (*sweep_grains)(const ContactView&, const ImpulseView&, double* bodies, double mu);
  void (*momentum_grains)(const ContactView&, const ImpulseView&, double* bodies, double mu,
                          const MomentumView&);
  void (*sweep_wall)(const ContactView&, const ImpulseView&, double* bodies, double mu, const WallView&);
  void (*momentum_wall)(const ContactView&, const ImpulseView&, double* bodies, double mu, const WallView&,
                        const MomentumView&);
  void (*sweep_cell)(const ContactView&, const ImpulseView&, double* bodies, double mu, const CellView&);
  void (*momentum_cell)(const ContactView&, const ImpulseView&, double* bodies, double mu, const CellView&,
                        const MomentumView&);
  /// Momentum in single precision.
  void (*single_grains)(const SingleContactView&, const SingleImpulseView&, float* bodies, double mu,
                        const MomentumView&);
  void (*single_wall)(const SingleContactView&, const SingleImpulseView&, float* bodies, double mu,
                      const WallView&, const MomentumView&);
  void (*single_cell)(const SingleContactView&, const SingleImpulseView&, float* bodies, double mu,
                      const CellView&, const MomentumView&);
  void (*accumulate_grains)(const ContactView&, double* bodies);
  void (*accumulate_wall)(const ContactView&, double* bodies, const WallView&);
  ErrorTotals (*error_grains)(const ContactView&, const double* bodies, double mu, const WholeView&);
  ErrorTotals (*error_wall)(const ContactView&, const double* bodies, double mu, const WholeView&);
  ErrorTotals (*error_cell)(const ContactView&, const double* bodies, double mu, const WholeView&,
                            const CellView&);
  /// Momentum of whole records at `slots`.
  void (*advance_bodies)(double* bodies, double* last, const std::int32_t* slots, std::size_t count,
                         double beta);
  void (*advance_single)(float* bodies, float* last, const std::int32_t* slots, std::size_t count,
                         double beta);
};

/// Constants, and no functions: whoever called one to see what there is would run instructions that the
/// processor may not have.
/// Without friction, with one coefficient in a chunk, and with one per contact.
extern const LaneKernels lane_kernels_portable[3];
extern const LaneKernels lane_kernels_avx2[3];
extern const LaneKernels lane_kernels_avx512[2];  ///< those with friction

}  // namespace talus
