#pragma once

/// The copies of bodies in the subdomains of a rank.

#include <cstdint>
#include <span>

#include "runtime/step/decomposition.hpp"

namespace talus::detail {

/// Grains of this multiplicity or a higher one are hubs: they are glued once a sweep, through one rank.
/// Gluing a hub has to wait for the sweeps of all subdomain colours, and no other work hides that wait; so a
/// single hub disables subdomain colours.
std::int32_t hubs_from(const DecompositionSettings& settings);

/// From the interfaces, which hold the bodies of the surroundings: multiplicities of the copies, their parts
/// of the mass, which copy counts, and where each subdomain's slots begin. `id`: of the surroundings; `hubs`:
/// see hubs_from. Throws std::runtime_error when a body stands in more than 65535 subdomains.
void list_copies(Decomposition& decomposition, Coupling coupling, const BodySubdomains& incidences,
                 std::span<const BodyId> id, std::int32_t hubs);

/// Copies of the bodies of the interfaces, after list_copies. Goes field by field, and frees each field of
/// the surroundings when it has been copied.
Bodies make_copies(Decomposition& decomposition, Bodies& around);

/// Bodies of the surroundings that stand in a subdomain of this rank now and did not before, each counted per
/// subdomain. `slot_begin`: of the slots before.
std::int64_t arrivals(const Decomposition& decomposition, const Surroundings& around,
                      std::span<const std::size_t> slot_begin);

}  // namespace talus::detail
