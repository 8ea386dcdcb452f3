#pragma once

/// Connected clusters of contacts, and sums over each of them: an error of one chain must not be hidden by
/// the mean of a large sample.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "kernels/global/body_parts.hpp"

namespace talus {

/// Bodies that are joined by contacts, over any number of parts. Driven and fixed walls join nothing; a wall
/// of finite mass is a body like others.
struct Clusters {
  std::vector<std::vector<std::int32_t>> of_body;   ///< per part and unknown; -1: no contact there
  std::vector<std::int32_t> count;                  ///< per part
  std::vector<std::vector<std::int32_t>> spanning;  ///< per part and cluster: its number among those that lie
                                                    ///< in several parts; -1: in this part only
  std::int32_t several = 0;                         ///< clusters that lie in several parts

  std::vector<std::vector<std::int32_t>> bodies;  ///< per part and cluster: of all parts, each body once

  std::int32_t of_contact(std::size_t part, const ContactEquation& c) const {
    return of_body[part][static_cast<std::size_t>(c.first)];
  }
};

/// Collective: one sum over copies and, with several parts, three gathers, of as many numbers as there are
/// pairs of clusters that meet at a border.
Clusters clusters_of(std::span<const ContactGraph> parts, const PartLink& link);

/// Numbers per cluster: per part `count` rows of `sums + maxima` numbers.
struct ClusterRows {
  std::size_t sums = 0, maxima = 0;
  std::vector<std::vector<double>> rows;

  std::size_t width() const { return sums + maxima; }
  std::span<double> of(std::size_t part, std::int32_t cluster) {
    return std::span(rows[part]).subspan(static_cast<std::size_t>(cluster) * width(), width());
  }
  std::span<const double> of(std::size_t part, std::int32_t cluster) const {
    return std::span(rows[part]).subspan(static_cast<std::size_t>(cluster) * width(), width());
  }
};

/// The largest number of bodies in a cluster; 0 without contacts. Collective.
std::int32_t largest_cluster(const Clusters& clusters, const PartLink& link);
/// Per part and unknown, 1 in clusters of at least `least` and at most `most` bodies, else 0.
std::vector<std::vector<char>> in_clusters_of(const Clusters& clusters, std::int32_t least,
                                              std::int32_t most);

/// Calls fill(part, rows) to add to the rows of each part, from 0, then adds up (or takes the largest of)
/// what parts have of a cluster, in order of subdomain: every part that holds some of it gets the same.
/// Collective.
ClusterRows rows_of_clusters(const BodyParts& parts, const Clusters& clusters, std::size_t sums,
                             std::size_t maxima, const std::function<void(std::size_t, ClusterRows&)>& fill);

/// The largest of value(part, cluster) over all clusters of all parts, at least 0; NaN where one is.
/// Collective.
double largest_of_clusters(const BodyParts& parts, const Clusters& clusters,
                           const std::function<double(std::size_t, std::int32_t)>& value);

}  // namespace talus
