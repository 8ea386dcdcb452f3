#pragma once

/// Attractions of contacts (kernels/law/attraction.hpp): the classical shift of Signorini's condition and
/// Coulomb's cone (Radjai and Richefeu 2009, "Contact dynamics as a nonsmooth discrete element method"),
///
///     r_n + c h >= 0,     |r_t| <= mu (r_n + c h),
///
/// for grains that touch, c [N] being the force that parts them. The law of kernels/law holds as it stands
/// for s = r + c h n: contacts store s, and c h n pulls their bodies together as a force from outside would.

#include <span>

#include "kernels/detection/contacts.hpp"
#include "kernels/detection/narrow_phase.hpp"
#include "kernels/sweeps/sweep.hpp"

namespace talus {

/// Fills Contacts::cohesion of a chunk, c h [N s] (c h/(1 + E) with Moreau's restitution), 0 for contacts
/// that do not touch. Does nothing where the array is empty.
void find_cohesion(const NarrowPhase& in, const Candidates& candidates, const Chunks& chunks,
                   std::size_t chunk, Contacts& contacts);

/// V -= M^-1 H c h n of the contacts of a range; `wall` is null between grains.
void pull_together(const Contacts& contacts, ContactRange range, std::span<Velocity> velocity,
                   WallCopy* wall);

/// Sum of c h n over a range [N s]: by this the sum of s at a wall exceeds that of r.
Vec3 sum_of_cohesion(const Contacts& contacts, ContactRange range);

}  // namespace talus
