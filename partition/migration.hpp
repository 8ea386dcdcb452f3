#pragma once

/// Who moves when the partition, or the grains, have changed.

#include <cstdint>
#include <span>
#include <vector>

#include "kernels/types.hpp"
#include "partition/interface.hpp"

namespace talus {

/// A copy of a body that must come into being in a subdomain where the body did not stand before.
struct BodyMove {
  Slot body;
  std::int32_t from;  ///< subdomain that gives the data; -1 for a body that stood nowhere
  std::int32_t to;
  bool travels;  ///< between ranks, and not with another move of the same body to the same rank
  bool operator==(const BodyMove&) const = default;
};

struct Migration {
  std::vector<BodyMove> arrivals;    ///< in order of (from, to, id)
  std::vector<Standing> departures;  ///< copies to forget, in order of (subdomain, id)
  std::int64_t migrants = 0;         ///< bodies with an arrival: N_MG of the paper's Table 2
};

/// Compares where bodies stood with where they stand. `rank_of_subdomain` gives the rank of every subdomain,
/// the same before and after. Data come from the lowest old subdomain on the receiving rank if there is one,
/// else from the lowest of all, the owner. A rank plans for the bodies it holds; two ranks that hold the same
/// body plan the same for it, so each sends the arrivals with `travels` whose `from` it has. `before`, `now`
/// and `id` describe the same bodies.
Migration plan_migration(const BodySubdomains& before, const BodySubdomains& now, std::span<const BodyId> id,
                         std::span<const std::int32_t> rank_of_subdomain);

/// A candidate whose point is now in another subdomain: its impulse, the warm start, goes along.
struct CandidateMove {
  std::int32_t candidate;
  std::int32_t from;
  std::int32_t to;
  bool operator==(const CandidateMove&) const = default;
};

/// Moves of the candidates in `before` and `now` (subdomains, one entry per candidate), in order of (from,
/// to, candidate).
std::vector<CandidateMove> plan_candidate_moves(std::span<const std::int32_t> before,
                                                std::span<const std::int32_t> now);

}  // namespace talus
