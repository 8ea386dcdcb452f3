#include "kernels/clusters/clusters.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <utility>

#include "kernels/bodies/index.hpp"
#include "kernels/clusters/disjoint_sets.hpp"

namespace talus {

namespace {

/// The clusters of one part, numbered by their lowest bodies. Shared bodies may have their contacts
/// elsewhere: each is in a cluster.
std::pair<std::vector<std::int32_t>, std::int32_t> clusters_within(const ContactGraph& graph) {
  DisjointSets sets(graph.mass.size());
  std::vector<char> touched(graph.mass.size(), 0);
  for (const auto& [first, second] : graph.pairs) {
    touched[at(first)] = 1;
    if (graph.cell >= 0) {
      touched[at(graph.cell)] = 1;
      sets.join(first, graph.cell);
    }
    if (second < 0) continue;
    touched[at(second)] = 1;
    sets.join(first, second);
  }
  for (const std::int32_t b : graph.shared) touched[at(b)] = 1;
  std::vector<std::int32_t> number(graph.mass.size(), -1);
  std::int32_t count = 0;
  for (std::size_t b = 0; b < number.size(); ++b) {
    if (!touched[b]) continue;
    std::int32_t& first = number[at(sets.find(static_cast<std::int32_t>(b)))];
    if (first < 0) first = count++;
    number[b] = first;
  }
  return {std::move(number), count};
}

/// Bodies and joints per cluster.
void count(std::span<const ContactGraph> parts, const PartLink& link, Clusters& clusters) {
  clusters.bodies.resize(parts.size());
  clusters.joints.resize(parts.size());
  const auto several = at(clusters.several);
  link.each(parts.size(), [&](std::size_t p) {
    clusters.bodies[p].assign(at(clusters.count[p]), 0);
    clusters.joints[p].assign(at(clusters.count[p]), 0);
    for (std::size_t b = 0; b < clusters.of_body[p].size(); ++b)
      if (clusters.of_body[p][b] >= 0 && parts[p].counted(b))
        ++clusters.bodies[p][at(clusters.of_body[p][b])];
    for (const auto& [first, second] : parts[p].pairs)
      if (second >= 0) ++clusters.joints[p][at(clusters.of_body[p][at(first)])];
  });
  if (several == 0) return;
  const auto each_spanning = [&](std::size_t p, const auto& take) {
    for (std::size_t c = 0; c < clusters.bodies[p].size(); ++c)
      if (const std::int32_t number = clusters.spanning[p][c]; number >= 0)
        take(2 * at(number), clusters.bodies[p][c], clusters.joints[p][c]);
  };
  const std::vector<double> sums =
      total_of(link, parts.size(), 2 * several, [&](std::size_t p, std::span<double> row) {
        each_spanning(p, [&](std::size_t k, std::int32_t bodies, std::int32_t joints) {
          row[k] += bodies;
          row[k + 1] += joints;
        });
      });
  for (std::size_t p = 0; p < parts.size(); ++p)
    each_spanning(p, [&](std::size_t k, std::int32_t& bodies, std::int32_t& joints) {
      bodies = static_cast<std::int32_t>(sums[k]);
      joints = static_cast<std::int32_t>(sums[k + 1]);
    });
}

bool is_small(std::int32_t bodies, std::int32_t joints, const SmallClusters& small, bool friction) {
  return bodies <= (friction ? small.bodies : small.smooth) ||
         (bodies <= small.chained && joints - bodies < small.loops);
}

/// Which clusters of the parts are one, through bodies that they share: numbers them.
void join_clusters(std::span<const ContactGraph> parts, const PartLink& link, Clusters& clusters) {
  // Names of clusters that are unlike in all parts: the subdomain, then the number there. The body that
  // counts tells its copies the name of its own.
  PartField name(parts.size());
  link.each(parts.size(), [&](std::size_t p) {
    name[p].resize(parts[p].mass.size());
    for (const std::int32_t b : parts[p].shared)
      if (parts[p].counted(at(b)))
        name[p][at(b)].u = Vec3(parts[p].subdomain + 1, clusters.of_body[p][at(b)], 0);
  });
  link.sum_copies(name);
  std::vector<std::vector<double>> pairs(parts.size());
  link.each(parts.size(), [&](std::size_t p) {
    std::vector<std::array<std::int32_t, 3>> met;  // subdomain, cluster there, cluster here
    for (const std::int32_t b : parts[p].shared)
      if (!parts[p].counted(at(b)) && name[p][at(b)].u[0] > 0)
        met.push_back({static_cast<std::int32_t>(name[p][at(b)].u[0]) - 1,
                       static_cast<std::int32_t>(name[p][at(b)].u[1]), clusters.of_body[p][at(b)]});
    std::sort(met.begin(), met.end());
    met.erase(std::unique(met.begin(), met.end()), met.end());
    for (const auto& [subdomain, there, here] : met)
      pairs[p].insert(pairs[p].end(), {static_cast<double>(subdomain), static_cast<double>(there),
                                       static_cast<double>(parts[p].subdomain), static_cast<double>(here)});
  });
  const std::vector<double> all = gather_padded(link, pairs, -1);
  using Name = std::pair<std::int32_t, std::int32_t>;  // subdomain, cluster
  std::vector<std::pair<Name, Name>> joined;
  std::vector<Name> names;
  for (std::size_t k = 0; k + 3 < all.size(); k += 4) {
    if (all[k] < 0) continue;
    const Name a{static_cast<std::int32_t>(all[k]), static_cast<std::int32_t>(all[k + 1])},
        b{static_cast<std::int32_t>(all[k + 2]), static_cast<std::int32_t>(all[k + 3])};
    joined.emplace_back(a, b);
    names.insert(names.end(), {a, b});
  }
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
  const auto place = [&](const Name& n) {
    return static_cast<std::int32_t>(std::lower_bound(names.begin(), names.end(), n) - names.begin());
  };
  DisjointSets sets(names.size());
  for (const auto& [a, b] : joined) sets.join(place(a), place(b));
  std::vector<std::int32_t> number(names.size(), -1);
  for (std::size_t k = 0; k < names.size(); ++k) {
    const auto own = static_cast<std::int32_t>(k);
    number[k] = sets.find(own) == own ? clusters.several++ : number[at(sets.find(own))];
  }
  for (std::size_t p = 0; p < parts.size(); ++p)
    for (std::size_t k = 0; k < names.size(); ++k)
      if (names[k].first == parts[p].subdomain) clusters.spanning[p][at(names[k].second)] = number[k];
}

}  // namespace

Clusters clusters_of(std::span<const ContactGraph> parts, const PartLink& link) {
  Clusters clusters;
  clusters.of_body.resize(parts.size());
  clusters.count.resize(parts.size());
  clusters.spanning.resize(parts.size());
  link.each(parts.size(), [&](std::size_t p) {
    std::tie(clusters.of_body[p], clusters.count[p]) = clusters_within(parts[p]);
    clusters.spanning[p].assign(at(clusters.count[p]), -1);
  });
  if (link.several()) join_clusters(parts, link, clusters);
  count(parts, link, clusters);
  return clusters;
}

std::vector<std::vector<char>> in_small_clusters(const Clusters& clusters, const SmallClusters& small,
                                                 bool friction) {
  std::vector<std::vector<char>> in(clusters.of_body.size());
  for (std::size_t p = 0; p < in.size(); ++p)
    for (const std::int32_t c : clusters.of_body[p])
      in[p].push_back(
          c >= 0 && is_small(clusters.bodies[p][at(c)], clusters.joints[p][at(c)], small, friction) ? 1 : 0);
  return in;
}

BodyGroups large_clusters_of(const Clusters& clusters, const std::vector<std::vector<char>>& in_small,
                             std::span<const ContactGraph> parts, const PartLink& link) {
  // Per part and cluster: of those that are large.
  std::vector<std::vector<char>> large(parts.size());
  link.each(parts.size(), [&](std::size_t p) {
    large[p].assign(at(clusters.count[p]), 0);
    for (const auto& [first, second] : parts[p].pairs)
      if (in_small[p][at(first)] == 0) large[p][at(clusters.of_body[p][at(first)])] = 1;
  });
  // A row: how many lie in this part only, and which of those that lie in several have contacts here.
  const std::size_t width = 1 + at(clusters.several);
  const std::vector<double> rows =
      rows_of(link, parts.size(), width, [&](std::size_t p, std::span<double> row) {
        for (std::size_t c = 0; c < large[p].size(); ++c)
          if (large[p][c] != 0) row[at(clusters.spanning[p][c] + 1)] += 1;
      });
  BodyGroups groups{.of_body = {}, .count = 0};
  std::vector<std::int32_t> of_spanning(at(clusters.several), -1);
  for (std::size_t s = 0; s < of_spanning.size(); ++s)
    for (std::size_t row = 0; row < rows.size() && of_spanning[s] < 0; row += width)
      if (rows[row + 1 + s] > 0) of_spanning[s] = groups.count++;
  std::vector<std::int32_t> first;  // per subdomain
  for (std::size_t row = 0; row < rows.size(); row += width) {
    first.push_back(groups.count);
    groups.count += static_cast<std::int32_t>(rows[row]);
  }
  for (std::size_t p = 0; p < parts.size(); ++p) {
    std::vector<std::int32_t> number(large[p].size(), -1);
    std::int32_t next = first[at(parts[p].subdomain)];
    for (std::size_t c = 0; c < number.size(); ++c) {
      const std::int32_t spans = clusters.spanning[p][c];
      number[c] = spans >= 0 ? of_spanning[at(spans)] : large[p][c] != 0 ? next++ : -1;
    }
    std::vector<std::int32_t>& of_body = groups.of_body.emplace_back();
    for (const std::int32_t c : clusters.of_body[p]) of_body.push_back(c < 0 ? -1 : number[at(c)]);
  }
  return groups;
}

std::vector<double> gather_padded(const PartLink& link, const std::vector<std::vector<double>>& rows,
                                  double filler) {
  const std::vector<double> lengths =
      rows_of(link, rows.size(), 1,
              [&](std::size_t p, std::span<double> row) { row[0] = static_cast<double>(rows[p].size()); });
  const auto most = static_cast<std::size_t>(*std::max_element(lengths.begin(), lengths.end()));
  if (most == 0) return {};
  return rows_of(link, rows.size(), most, [&](std::size_t p, std::span<double> row) {
    std::fill(row.begin(), row.end(), filler);
    std::copy(rows[p].begin(), rows[p].end(), row.begin());
  });
}

}  // namespace talus
