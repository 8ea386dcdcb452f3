#pragma once

/// Overlaps are undone in a problem of their own, whose unknowns are displacements d [m] of the bodies:
///
///     min 1/2 d.M d   with   n.(d_i - d_j) + b >= 0,     b = c g where g < 0, else g,
///
/// g [m] being the gap of a contact and c the part of an overlap that goes. It is the problem of a step
/// without friction in which bodies are at rest, with displacements for velocities, so that the sweeps of
/// steps solve it. Velocities, impulses, and the certificate of a step do not depend on it. Bodies are
/// shifted and do not turn. In single precision: 1e-7 of a displacement is below the rounding of positions.

#include <span>

#include "kernels/bodies/motion.hpp"
#include "kernels/detection/contacts.hpp"
#include "kernels/detection/measures.hpp"
#include "kernels/sweeps/single_precision.hpp"
#include "kernels/sweeps/sweep.hpp"

namespace talus {

/// Sizes the arrays for the contacts and bodies: displacements are 0, masses those of `velocity`. With
/// friction the pushes take the room of the impulses along x, until end_positions gives it back: nothing else
/// needs either at the end of a step.
void begin_positions(const Contacts& contacts, std::span<const Velocity> velocity, SingleState& single,
                     SweepSteps& steps);
void end_positions(const Contacts& contacts, SingleState& single, SweepSteps& steps);

/// Takes the normals of a chunk's contacts over, and finds b from the places of its bodies at the end of the
/// step, before they are displaced. `part`: c in [0, 1].
void find_overlaps(const Contacts& contacts, const Chunks& chunks, std::size_t chunk, const Poses& poses,
                   double part, SingleState& single);

/// Warm start: `kept` has the pushes of the last step, per candidate. Overlaps, and with them the pushes that
/// undo them, fall by the part c in each step, so `first_pushes` starts a chunk from 1 - c times the pushes
/// of the last step, and applies these to its bodies, or to the wall copy. `keep_pushes` stores those of the
/// chunk for the next step.
void first_pushes(const Contacts& contacts, ContactRange range, std::span<const float> kept, double part,
                  SingleState& single, WallCopy* wall);
void keep_pushes(const Contacts& contacts, const Chunks& chunks, std::size_t chunk, const SingleState& single,
                 std::span<float> kept);

/// Takes a common part off the pushes of a chunk, once those of all chunks are applied, where as a whole they
/// push more than their overlaps ask for, by more than `excess` in (0, 1) of their work: the least of 1/2 d.M
/// d + p.b over s >= 0, the pushes p of the chunk being s times what they are. Pushes that a row of bodies
/// begins from would outlive by many steps an overlap that has opened by itself, as so few sweeps take them
/// away no faster than they travel along the row.
void lower_pushes(const Contacts& contacts, ContactRange range, double excess, SingleState& single,
                  WallCopy* wall);

/// One sweep with momentum over a chunk of blocks, which has no groups that could be swept at once;
/// SweepKernels sweeps the others. `wall` is null between bodies.
void sweep_displacements(const Contacts& contacts, ContactRange range, SingleState& single, WallCopy* wall,
                         const SweepMomentum& momentum);

/// x += d of a range of bodies.
void displace(SlotRange range, std::span<const SingleVelocity> displacement, std::span<Vec3> x);

}  // namespace talus
