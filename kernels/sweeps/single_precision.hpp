#pragma once

/// Sweeps in single precision: half the bytes, and more contacts a second. They reduce the error to about
/// 1e-6 of the velocities and impulses of the problem; what is certified, and everything but sweeps, is in
/// double precision (docs/decisions/0015-single-precision.md).
///
/// Impulses and mobilities stand in a unit of mass near that of the lightest grain, so that numbers of any
/// scale fit into floats; a power of two, so that a change of units by powers of two changes no bit.

#include <span>
#include <vector>

#include "kernels/bodies/bodies.hpp"
#include "kernels/detection/contacts.hpp"
#include "kernels/sweeps/sweep.hpp"

namespace talus {

/// What such sweeps read and write, besides groups and bodies of `Contacts`.
struct SingleState {
  SingleContacts contacts;
  std::vector<SingleVelocity> velocity;  ///< per slot: m/s, mobilities times `contacts.unit`
  std::vector<SingleVelocity> last_v;    ///< per slot: of the acceleration (momentum.hpp)
};

/// The unit [kg] for grains whose largest 1/m is `inv_mass` [1/kg] > 0.
double unit_of_mass(double inv_mass);

/// Makes room for `contacts` and bodies; the contents mean nothing yet.
void allocate(SingleState& single, const Contacts& contacts, std::size_t bodies);

/// Normals and biases of a range, impulses of a range, and the bodies at `slots`, rounded to single
/// precision.
void narrow_geometry(const Contacts& contacts, ContactRange range, SingleContacts& single);
void narrow_impulses(const Contacts& contacts, ContactRange range, SingleContacts& single);
void narrow_bodies(std::span<const Slot> slots, std::span<const Velocity> velocity, SingleState& single);

/// The inverse, which is exact: impulses of a range; velocities at `slots`, whose masses are left alone; and
/// steps of a range, which are then in N s.
void widen_impulses(const SingleContacts& single, ContactRange range, Contacts& contacts);
void widen_bodies(std::span<const Slot> slots, std::span<const SingleVelocity> single,
                  std::span<Velocity> velocity);
void widen_steps(double unit, ContactRange range, SweepSteps& steps);

std::size_t memory_used(const SingleState& single);

}  // namespace talus
