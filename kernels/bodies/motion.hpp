#pragma once

#include <array>
#include <span>

#include "kernels/bodies/bodies.hpp"

namespace talus {

/// Slots [begin, end).
struct SlotRange {
  std::size_t begin;
  std::size_t end;
};

/// Free velocity of the grains: their velocity at the end of the step if there were no contacts, V- + h g.
/// `w` is empty without friction or rotation, since the sweeps do not touch it then.
struct FreeVelocity {
  std::vector<std::array<double, 3>> u;  ///< [m/s]
  std::vector<std::array<double, 3>> w;  ///< [m/s]
};

/// First half of Moreau's theta-scheme (theta = 1/2): x += h/2 u-.
void predict(SlotRange range, std::span<Vec3> x, std::span<const Velocity> velocity, double time_step);

/// Free velocity = V- + h g.
void free_velocities(SlotRange range, std::span<const Velocity> velocity, double time_step,
                     const Vec3& gravity, FreeVelocity& free);

/// V = free velocity for the given grains.
void reset_to_free(std::span<const Slot> slots, const FreeVelocity& free, std::span<Velocity> velocity);

/// What contacts have done to grains.
struct Exchanged {
  double energy = 0;  ///< sum of m |u - u_free|^2 / 2 [J]
  double mass = 0;    ///< of the grains [kg]
};

/// Sums over grains; add them in a fixed order only.
struct MotionSums {
  KineticEnergy energy;         ///< at the end of the step [J]
  double energy_free = 0;       ///< translational and rotational, of the free velocity [J]
  Vec3 impulse = Vec3::Zero();  ///< sum of m (u - u_free) [N s]: what the contacts gave to the sample
  double impulse_scale = 0;     ///< sum of m |u - u_free| [N s]
  double speed2_max = 0;        ///< [m^2/s^2]; NaN if any velocity is
  Slot fastest = -1;

  void add(const MotionSums& other);
};

/// Where the mass of a copy is M/parts with parts other than the multiplicity m_i, both numbers; elsewhere
/// both are empty.
struct CopyShares {
  Multiplicities multiplicity = {}, parts = {};
};

/// A velocity that each body gains by where it is: that of a cell whose faces are sped up.
struct AffineGain {
  Mat3 gradient = Mat3::Zero();  ///< [1/s]
  Vec3 resting = Vec3::Zero();   ///< [m] where nothing is gained
  Vec3 at(const Vec3& x) const { return gradient * (x - resting); }
};

/// Adds the gain to the free velocities.
void add_gain(SlotRange range, std::span<const Vec3> x, const AffineGain& gain, FreeVelocity& free);
/// ... or to the velocities.
void add_gain(SlotRange range, std::span<const Vec3> x, const AffineGain& gain, std::span<Velocity> velocity);

/// How a step ends.
struct StepFinish {
  double time_step;  ///< h [s]
  CopyShares copies = {};
  double reflection =
      0;  ///< E: with Moreau's restitution V = (1 + E) Vbar - E V-, of the Vbar that was found
  Vec3 gain = Vec3::Zero();          ///< of the free velocity from V- [m/s]; asked for where E > 0
  const AffineGain* cell = nullptr;  ///< what x, of mid-step, adds to that; null: nothing
};

/// Second half: V of the end of the step where Vbar stood, x += h/2 u, and the sums. Impulses are those that
/// made Vbar. A copy adds M/m_i to the sums over bodies.
MotionSums finish(SlotRange range, std::span<Vec3> x, std::span<Velocity> velocity, const FreeVelocity& free,
                  const StepFinish& end);

/// Where the centres of the bodies in `range` will be then, and their velocities: x and, unless it is empty,
/// `velocity` of `ends`, which has room for them. Nothing else is changed.
void find_ends(SlotRange range, const Bodies& bodies, const FreeVelocity& free, const StepFinish& end,
               Bodies& ends);

/// The unit quaternion q turned by omega = w/R over `time_step`: exact for constant omega. w [m/s] of 3.
std::array<double, 4> turned(const std::array<double, 4>& q, const double* w, double radius,
                             double time_step);

/// Turns the orientations of spheres so; bodies with a `shape` other than 0 are left alone (turn_clumps).
void rotate(SlotRange range, Bodies& bodies, double time_step);

/// max(alert/2, h |u|): a pair becomes a contact when its gap is below the alert distance or closes within a
/// step. To this a grain's reach adds its radius, half the skin, which it may have used up before the
/// candidates are found anew, and more where it flies (StepGraph::make_cells).
double contact_margin(double speed, double time_step, double alert);

}  // namespace talus
