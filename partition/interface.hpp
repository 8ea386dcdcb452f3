#pragma once

/// Which bodies stand in which subdomains, and what subdomains must tell one another: the multiplicities,
/// interfaces and exchange lists of the paper's section 3.1.

#include <cstdint>
#include <span>
#include <vector>

#include "kernels/bodies/types.hpp"
#include "kernels/detection/broad_phase.hpp"
#include "kernels/detection/chunks.hpp"
#include "partition/subdomain.hpp"

namespace talus {

/// States that a body (a grain's slot, or the index of a wall) stands in a subdomain: one of its candidates
/// lies there.
struct BodyIncidence {
  std::int32_t body;
  SubdomainId subdomain;
  bool operator==(const BodyIncidence&) const = default;
};

/// Per body the subdomains it stands in, ascending, each once; their number is its multiplicity m_i.
/// Example: body 0 in subdomains 2 and 5, body 1 nowhere, body 2 in 5: begin {0, 2, 2, 3}, subdomain {2, 5,
/// 5}.
struct BodySubdomains {
  std::vector<std::int32_t> begin{0};  ///< bodies + 1 offsets into `subdomain`
  std::vector<SubdomainId> subdomain;

  std::size_t bodies() const { return begin.size() - 1; }
  std::int32_t multiplicity(std::size_t body) const { return begin[body + 1] - begin[body]; }
  std::span<const SubdomainId> of(std::size_t body) const {
    return std::span(subdomain).subspan(static_cast<std::size_t>(begin[body]),
                                        static_cast<std::size_t>(multiplicity(body)));
  }
  bool operator==(const BodySubdomains&) const = default;
};

/// From any list of incidences, in any order and with repetitions: those of the candidates found here, and
/// those that other ranks sent. 0 <= body < bodies.
BodySubdomains collect_incidences(std::size_t bodies, std::span<const BodyIncidence> incidences);

/// Grains of these candidates, which are in `subdomain` (grain pairs first, then wall pairs). The answer is
/// complete for a grain when all its candidates are given, whichever subdomain they are in; a subdomain is a
/// function of the point alone, so a rank can give those of other ranks' subdomains too. (Contacts at glued
/// walls are given to one of the subdomains in which their grain is known to stand, by the colours of these;
/// so they add no subdomain.) With `home` (one per grain, or empty) a grain without candidates stands in its
/// home, the subdomain of its centre: every grain then stands in some subdomain, which integrates its motion.
BodySubdomains grain_subdomains(std::size_t grains, std::span<const GrainPair> grain_pairs,
                                std::span<const WallPair> wall_pairs, std::span<const SubdomainId> subdomain,
                                std::span<const SubdomainId> home = {});

/// The same for walls; a wall stands where one of its candidates is. `subdomain`: of the wall pairs.
BodySubdomains wall_subdomains(std::size_t walls, std::span<const WallPair> wall_pairs,
                               std::span<const SubdomainId> subdomain);

/// A subdomain that stands around shared grains with this one.
struct Neighbour {
  SubdomainId subdomain;
  std::int32_t begin;  ///< into SubdomainInterface::exchange
  std::int32_t end;
};

/// Place of a body in the message between two subdomains: in the exchange list of one for the other.
using MessagePlace = Index<struct MessagePlaceTag>;

/// Where the copies of a shared grain are: in which neighbour's message, at which place of it.
struct CopySource {
  std::int32_t neighbour;  ///< index into `neighbours`, -1 for the copy of this subdomain
  MessagePlace place;      ///< in what that neighbour sends; none for the own copy
};

/// One subdomain's side of the interface. Everything is in an order that depends on ids and numbers of
/// subdomains only.
///
/// Example: grains with ids 10, 11, 12 stand in {0}, {0, 1}, {0, 1, 2}. Subdomain 0 has bodies {10, 11, 12},
/// multiplicity {1, 2, 3}, shared {1, 2}; neighbours {1: exchange 0..2, 2: exchange 2..3}, exchange {1, 2,
/// 2}: grains 11 and 12 with subdomain 1, grain 12 with subdomain 2. Copies of 11: own, then place 0 of
/// neighbour 0; of 12: own, place 1 of neighbour 0, place 0 of neighbour 1.
struct SubdomainInterface {
  SubdomainId subdomain{0};
  std::vector<Slot> bodies;                ///< the grains that stand here, in order of slot
  std::vector<std::int32_t> multiplicity;  ///< m_i >= 1 of each
  std::vector<std::int32_t> shared;        ///< indices into `bodies` of those with m_i > 1, in order of id
  std::vector<SubdomainId> owner;          ///< of each of `shared`: the lowest subdomain it stands in
  /// Of grains with m_i < hub_multiplicity: both sides of a pair of subdomains list the same grains in order
  /// of id, so that a message needs no ids.
  std::vector<Neighbour> neighbours;       ///< by ascending subdomain
  std::vector<std::int32_t> exchange;      ///< indices into `bodies`
  std::vector<std::int32_t> copies_begin;  ///< shared + 1 offsets into `copies`; none for a hub
  std::vector<CopySource> copies;          ///< all copies by ascending subdomain: the order of summation
  /// Grains with m_i >= hub_multiplicity: to send each copy to each other would cost m_i^2 messages. Their
  /// owner collects and returns (or a reduction does): indices into `shared`.
  std::vector<std::int32_t> hubs;
};

/// Interfaces of the subdomains `here` (ascending). `incidences` must be complete for every grain that stands
/// in one of them. `id` has one entry per grain. hub_multiplicity >= 3; the default lets eight boxes that
/// meet in a corner exchange directly. Walls are not among the bodies: a wall that k subdomains touch is a
/// reduction over its `wall_subdomains`.
std::vector<SubdomainInterface> build_interfaces(const BodySubdomains& incidences, std::span<const BodyId> id,
                                                 std::span<const SubdomainId> here,
                                                 std::int32_t hub_multiplicity = 9);

std::size_t memory_used(const BodySubdomains& incidences);
std::size_t memory_used(const SubdomainInterface& interface);

}  // namespace talus
