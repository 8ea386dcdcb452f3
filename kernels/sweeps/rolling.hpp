#pragma once

/// Moments of contacts that resist rolling (kernels/law/rolling_law.hpp): swept after the forces of their
/// chunk, contact by contact, with the normal impulses that these have now. Nothing happens in chunks and
/// scenes without rolling resistance, whose arrays are empty.

#include <span>

#include "kernels/detection/contacts.hpp"
#include "kernels/detection/narrow_phase.hpp"
#include "kernels/sweeps/sweep.hpp"

namespace talus {

/// Fills Contacts::arm of a chunk, mu_r l [m].
void find_arms(const NarrowPhase& in, const Candidates& candidates, const Chunks& chunks, std::size_t chunk,
               Contacts& contacts);

/// One pass over the moments of a range: m <- its law, R omega += dm R/I. `radius` [m] per slot.
void sweep_moments(Contacts& contacts, ContactRange range, std::span<const double> radius,
                   std::span<Velocity> velocity);

/// R omega += m R/I of the moments of a range.
void add_moments(const Contacts& contacts, ContactRange range, std::span<const double> radius,
                 std::span<Velocity> velocity);

/// Adds the errors of the moments of a range to the error sums of its forces, as speeds at the smaller radius
/// [m/s]. `parts` as in SweepKernels::error_grains.
void add_error_of_moments(const Contacts& contacts, ContactRange range, std::span<const double> radius,
                          std::span<const Velocity> velocity, Multiplicities parts, ErrorSums& sums);

}  // namespace talus
