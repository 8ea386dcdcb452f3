#pragma once

/// Small clusters of contacts as problems of their own, each whole in one place: what a direct solve wants.

#include <cstdint>
#include <span>
#include <vector>

#include "kernels/clusters/clusters.hpp"
#include "kernels/global/body_parts.hpp"

namespace talus {

/// One cluster. Bodies stand in order of the subdomain where they count and of their numbers there, contacts
/// in order of subdomain: the same wherever it is put together.
struct ClusterProblem {
  /// A body or contact, by the subdomain that it belongs to and its number in that part.
  struct Place {
    std::int32_t subdomain = 0, number = 0;
    friend auto operator<=>(const Place&, const Place&) = default;
  };
  BodyProblem problem;
  std::vector<Place> bodies;    ///< per unknown: where it counts
  std::vector<Place> contacts;  ///< per contact

  /// The part that answers for it where each is to be counted once: that of its first body.
  std::int32_t subdomain() const { return bodies.front().subdomain; }

  std::vector<Levers> levers;  ///< what contacts of blocks from other parts point to

  ClusterProblem() = default;
  ClusterProblem(ClusterProblem&&) = default;
  ClusterProblem& operator=(ClusterProblem&&) = default;
};

/// All clusters of the contacts in `parts` of which a contact or a counted body lies in a part here, in order
/// of their first bodies. A cluster that lies in parts of several processes is put together in each of them.
/// Levers of contacts that lie in parts here are those of `parts`. Collective: with several parts one sum
/// over copies and two gathers of what spans them.
std::vector<ClusterProblem> cluster_problems(const BodyParts& parts, const Clusters& clusters);

}  // namespace talus
