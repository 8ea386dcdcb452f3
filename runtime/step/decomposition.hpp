#pragma once

/// The sample of one rank: its copies of bodies, by subdomain, and how they are dealt to the ranks.

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "kernels/bodies/bodies.hpp"
#include "kernels/bodies/motion.hpp"
#include "kernels/detection/chunks.hpp"
#include "kernels/detection/domain.hpp"
#include "partition/interface.hpp"
#include "partition/partitioner.hpp"
#include "runtime/graph/communicator.hpp"
#include "runtime/step/setup.hpp"

namespace talus {

/// Index of a subdomain among those of this rank, which are in ascending order of their numbers. Groups of
/// the loop (runtime/graph/loop_plan.hpp) and Chunks::subdomain use this index.
using SubdomainPlace = Index<struct SubdomainPlaceTag>;

/// How space is cut, which rank has which subdomain, and which copies of bodies this rank has. The slots of
/// this rank are those of its first subdomain, then those of the second, ...; within a subdomain bodies stand
/// in Morton order, ties by id. All data of a subdomain are the same whatever rank it is on.
///
/// Example, two subdomains on one rank, grain 7 in both: slots 0..4 are subdomain 0 with grain 7 at slot 4,
/// slots 5..9 subdomain 1 with grain 7 at slot 5; multiplicity[4] = multiplicity[5] = 2, counts[4] = 1,
/// counts[5] = 0.
struct Decomposition {
  Partition partition;
  Per<SubdomainId, std::int32_t> rank_of;   ///< of every subdomain
  Per<SubdomainPlace, SubdomainId> here;    ///< subdomains of this rank, ascending
  std::vector<std::size_t> slot_begin;      ///< here + 1 offsets into the slots
  Per<SubdomainId, char> subdomain_colour;  ///< choose_subdomain_colours; empty unless they alternate
  std::vector<std::uint16_t> multiplicity;  ///< m_i per slot; empty with one subdomain
  std::vector<std::uint16_t> parts;         ///< per slot: the copy carries M/parts; empty likewise
  std::vector<char> taken;   ///< per slot: the body stands in a subdomain of an earlier subdomain colour,
                             ///< too, and is no hub; empty unless they alternate
  std::vector<char> counts;  ///< per slot: it is the copy of the lowest subdomain; empty likewise
  std::vector<std::array<double, 2>> whole;            ///< 1/M and R^2/I of the body [1/kg]; empty likewise
  Per<SubdomainPlace, SubdomainInterface> interfaces;  ///< bodies[k] stands in slot_begin + k. Empty likewise
  bool orientation = false;       ///< bodies have orientations, even if this rank has no body
  bool materials = false;         ///< likewise materials
  bool shapes = false;            ///< likewise shapes
  std::int64_t migrants = 0;      ///< bodies new to a subdomain since the last distribution, all ranks
  double imbalance = 0;           ///< candidates of the fullest subdomain over the mean, less 1
  Per<SubdomainId, double> cost;  ///< of a candidate, the mean being 1; empty: all equal
  bool blind = false;             ///< space was cut when no candidate was known

  bool several() const { return partition.subdomains > 1; }
  bool in_colours() const {
    return std::ranges::any_of(subdomain_colour, [](char t) { return t > 0; });
  }
  int subdomain_colour_of(SubdomainId subdomain) const {
    return subdomain_colour.empty() ? 0 : subdomain_colour[subdomain];
  }
  /// Place of a subdomain of this rank.
  SubdomainPlace place_of(SubdomainId subdomain) const {
    return SubdomainPlace(std::ranges::lower_bound(here, subdomain) - here.begin());
  }
  SlotRange slots_of(SubdomainPlace e) const { return {slot_begin[e.at()], slot_begin[e.at() + 1]}; }
};

/// Whether this copy counts for its body: exactly one copy of each body does.
bool counts(const Decomposition& decomposition, std::size_t slot);
/// Velocity of a slot with the masses of the whole body.
Velocity whole_velocity(const Decomposition& decomposition, const Bodies& bodies, std::size_t slot);

/// The same settings for `n` > 0 subdomains. Boxes per axis that give another number are replaced by zeros.
DecompositionSettings with_subdomains(DecompositionSettings settings, int n);

/// One subdomain per rank unless the settings say more; settings.mapping assigns subdomains to ranks.
/// Throws std::invalid_argument when there are more ranks than subdomains.
Decomposition make_decomposition(const DecompositionSettings& settings, const graph::Communicator& ranks);

/// How to cut space into `subdomains` by the settings.
PartitionOptions partition_options(const DecompositionSettings& settings, std::int32_t subdomains);

/// The ranks as a partitioner sees them.
Reduction reduction_over(const graph::Communicator& ranks);

/// The distinct bodies that a rank needs to find its candidates: those in and around its subdomains, in
/// Morton order of the partition's frame. Masses are whole.
struct Surroundings {
  Bodies bodies;
  std::vector<double> reach;                         ///< [m]
  std::vector<Slot> of_slot;                         ///< where the body of a slot is now; -1: not here
  std::vector<std::pair<std::int64_t, Slot>> by_id;  ///< sorted
  Slot find(std::int64_t id) const;                  ///< -1 when it is not among them
};

/// Bodies and candidates of a rank, which are replaced when the sample is dealt out anew.
struct RankSample {
  Bodies& bodies;
  Candidates& candidates;
  Domain domain;  ///< in which they stand at present
};

/// Collective. Makes the partition anew if asked to, and collects the surroundings: bodies within three times
/// the largest reach of this rank's regions, so that each candidate whose midpoint is here, and each other
/// candidate of its bodies, is found here without further messages; in a periodic domain their images count,
/// too, and centres are wrapped. `reach` [m]: of the slots of the sample. The state of the bodies moves to
/// the surroundings; ids and centres stay in the sample for `distribute`.
Surroundings collect_surroundings(Decomposition& decomposition, const DecompositionSettings& settings,
                                  const graph::Communicator& ranks, const RankSample& sample,
                                  std::span<const double> reach, bool partition_anew);

/// Candidates found among the surroundings.
struct FoundCandidates {
  Candidates candidates;        ///< between places in the surroundings; without impulses
  std::span<const char> glued;  ///< per wall: it has a finite mass
  /// Candidates between places in the surroundings whose impulses the found ones start from; null: they start
  /// from those of the sample.
  const Candidates* begun_from = nullptr;
};

/// Collective. Makes from the candidates found the copies of bodies, the candidates with the impulses of
/// those in `sample`, and the groups of this rank. The sample is replaced; the bodies of the surroundings are
/// gone afterwards, their reaches stay.
std::vector<CandidateGroup> distribute(Decomposition& decomposition, const DecompositionSettings& settings,
                                       const graph::Communicator& ranks, Surroundings& around,
                                       FoundCandidates among, const RankSample& sample);

std::size_t memory_used(const Decomposition& decomposition);

/// Candidates in a chunk of a subdomain, from the numbers of all candidates and of its own. Small samples get
/// small chunks, since a colour would otherwise have too few chunks for the threads. A subdomain that has
/// many more chunks than threads, and exceeds the cache, gets larger ones: what a chunk reads then comes in
/// longer runs (docs/decisions/0008-lanes.md).
int chunk_target(std::int64_t all, std::int64_t own);

}  // namespace talus
