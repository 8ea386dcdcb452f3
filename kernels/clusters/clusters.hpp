#pragma once

/// Connected clusters of contacts: an error of one chain must not be hidden by the mean of a large sample.

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/global/body_parts.hpp"

namespace talus {

/// Bodies that are joined by contacts, over any number of parts. Driven and fixed walls join nothing; a wall
/// of finite mass is a body like others. A cell that follows a stress joins all.
struct Clusters {
  std::vector<std::vector<std::int32_t>> of_body;   ///< per part and unknown; -1: no contact there
  std::vector<std::int32_t> count;                  ///< per part
  std::vector<std::vector<std::int32_t>> spanning;  ///< per part and cluster: its number among those that lie
                                                    ///< in several parts; -1: in this part only
  std::int32_t several = 0;                         ///< clusters that lie in several parts

  // Per part and cluster, of all parts:
  std::vector<std::vector<std::int32_t>> bodies;  ///< each once
  std::vector<std::vector<std::int32_t>> joints;  ///< contacts between two of its bodies

  std::int32_t of_contact(std::size_t part, const ContactEquation& c) const {
    return of_body[part][static_cast<std::size_t>(c.first)];
  }
};

/// Collective: one sum over copies and, with several parts, three gathers, of as many numbers as there are
/// pairs of clusters that meet at a border.
Clusters clusters_of(std::span<const ContactGraph> parts, const PartLink& link);

/// Clusters that a direct solve over their bodies is cheap for: those of few bodies, and chains. In a chain,
/// a row, an arch or a column contacts close few loops, and elimination leaves fewer bodies than twice the
/// loops to be eliminated together, however long it is.
struct SmallClusters {
  std::int32_t bodies = 200;    ///< at most so many, >= 0, whatever their loops
  std::int32_t smooth = 500;    ///< the same where no contact has friction, and rounds settle
  std::int32_t loops = 100;     ///< of more bodies: loops at most, >= 0
  std::int32_t chained = 5000;  ///< and bodies at most, >= `bodies`

  /// The same, none of more bodies than `most`.
  SmallClusters within(std::int32_t most) const {
    return {std::min(bodies, most), std::min(smooth, most), loops, std::min(chained, most)};
  }
};

/// Per part and unknown, 1 in small clusters, else 0. `friction`: some contact may have it.
std::vector<std::vector<char>> in_small_clusters(const Clusters& clusters, const SmallClusters& small,
                                                 bool friction);

/// The clusters that are not small, numbered alike in all parts; without contacts count is 0. Collective: one
/// gather.
BodyGroups large_clusters_of(const Clusters& clusters, const std::vector<std::vector<char>>& in_small,
                             std::span<const ContactGraph> parts, const PartLink& link);

/// Rows of any lengths, one per part: padded with `filler` to the longest of all, and gathered in order of
/// subdomain. Collective.
std::vector<double> gather_padded(const PartLink& link, const std::vector<std::vector<double>>& rows,
                                  double filler);

}  // namespace talus
