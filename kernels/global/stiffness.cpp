#include "kernels/global/stiffness.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <utility>

#include "kernels/bodies/index.hpp"

namespace talus {

namespace {

/// One part's bodies by their distance over contacts from the driven walls.
struct Layers {
  const ContactGraph& graph;
  std::vector<std::uint32_t> begin;              ///< per unknown + 1, into `other`
  std::vector<std::int32_t> other;               ///< neighbours, in order of contact
  std::vector<std::int32_t> depth;               ///< per unknown; -1: not reached
  std::vector<std::vector<std::int32_t>> layer;  ///< unknowns by depth
  std::size_t begun = 0;                         ///< where the new unknowns of the layer taken last begin
  std::vector<std::int32_t> met;                 ///< unknowns whose mark may have been set
  std::vector<char> mark;                        ///< per unknown: of the layer that comes next
  std::vector<std::int32_t> parts;               ///< per unknown: contacts with the layer below
  std::vector<double> load, gain;                ///< per unknown: what is handed on, and handed to it [kg]

  explicit Layers(const ContactGraph& of)
      : graph(of), begin(of.mass.size() + 2, 0), depth(of.mass.size(), -1), mark(of.mass.size(), 0) {
    // Counted two places further on, so that filling moves each beginning to its place.
    for (const auto& [first, second] : graph.pairs)
      if (second >= 0) {
        ++begin[at(first) + 2];
        ++begin[at(second) + 2];
      }
    for (std::size_t b = 1; b + 1 < begin.size(); ++b) begin[b + 1] += begin[b];
    other.resize(begin.back());
    for (const auto& [first, second] : graph.pairs)
      if (second >= 0) {
        other[begin[at(first) + 1]++] = second;
        other[begin[at(second) + 1]++] = first;
      }
    begin.pop_back();
  }
  std::span<const std::int32_t> neighbours(std::int32_t body) const {
    return std::span(other).subspan(begin[at(body)], begin[at(body) + 1] - begin[at(body)]);
  }
  bool below(std::int32_t from, std::int32_t to) const {
    return to < 0 ? depth[at(from)] == 1 : depth[at(to)] == depth[at(from)] - 1;
  }
};

/// The parts and their link.
struct Graph {
  std::vector<Layers> parts;
  const PartLink& link;
  PartField shared;  ///< what copies tell one another; empty where there is one part

  Graph(std::span<const ContactGraph> graphs, const PartLink& of) : link(of) {
    parts.reserve(graphs.size());
    for (const ContactGraph& graph : graphs) parts.emplace_back(graph);
    if (link.several())
      for (const Layers& part : parts) shared.emplace_back(part.depth.size());
  }
  /// Each copy of a shared unknown gets the sum of the numbers of all copies.
  template <class Number>
  void sum_copies(std::vector<Number> Layers::*numbers) {
    if (!link.several()) return;
    each([&](std::size_t p) {
      for (std::int32_t b : parts[p].graph.shared) {
        shared[p][at(b)] = Twist{};
        shared[p][at(b)].u[0] = static_cast<double>((parts[p].*numbers)[at(b)]);
      }
    });
    link.sum_copies(shared);
    each([&](std::size_t p) {
      // A wall has as many copies as there are parts, more than its mark can count.
      constexpr auto most = static_cast<double>(std::numeric_limits<Number>::max());
      for (std::int32_t b : parts[p].graph.shared)
        (parts[p].*numbers)[at(b)] = static_cast<Number>(std::min(most, shared[p][at(b)].u[0]));
    });
  }
  void each(const std::function<void(std::size_t)>& work) const { link.each(parts.size(), work); }
};

/// Unknowns marked in any part that have no depth yet become the layer `depth`. False when there are none.
bool take_layer(Graph& graph, std::int32_t depth) {
  graph.sum_copies(&Layers::mark);
  return total_of(graph.link, graph.parts.size(), 1, [&](std::size_t p, std::span<double> row) {
           Layers& here = graph.parts[p];
           if (here.layer.size() <= at(depth)) here.layer.resize(at(depth) + 1);
           std::vector<std::int32_t>& layer = here.layer[at(depth)];
           here.begun = layer.size();
           const auto take = [&](std::int32_t b) {
             if (here.mark[at(b)] != 0 && here.depth[at(b)] < 0) {
               here.depth[at(b)] = depth;
               layer.push_back(b);
             }
             here.mark[at(b)] = 0;
           };
           for (std::int32_t b : here.met) take(b);
           for (std::int32_t b : here.graph.shared) take(b);
           here.met.clear();
           row[0] = static_cast<double>(layer.size() - here.begun);
         })[0] > 0;
}

/// Without a driven wall the walk begins at the heaviest body that touches another, on which the others come
/// to rest.
void mark_heaviest(Graph& graph) {
  std::vector<std::size_t> heaviest(graph.parts.size());
  const auto find = [&](std::size_t p, std::span<double> row) {
    const Layers& here = graph.parts[p];
    for (std::size_t b = 0; b < here.depth.size(); ++b)
      if (!here.neighbours(static_cast<std::int32_t>(b)).empty() && here.graph.mass[b] > row[0]) {
        row[0] = here.graph.mass[b];
        heaviest[p] = b;
      }
  };
  const std::vector<double> masses = rows_of(graph.link, graph.parts.size(), 1, find);
  std::size_t most = 0;
  for (std::size_t k = 1; k < masses.size(); ++k)
    if (masses[k] > masses[most]) most = k;
  for (std::size_t p = 0; p < graph.parts.size(); ++p)
    if (at(graph.parts[p].graph.subdomain) == most && masses[most] > 0) {
      graph.parts[p].mark[heaviest[p]] = 1;
      graph.parts[p].met.push_back(static_cast<std::int32_t>(heaviest[p]));
    }
}

/// Calls visit(size, heaviest body) for each cluster of one part that no walk has come to.
template <class Visit>
void each_unreached(const Layers& here, const Visit& visit) {
  std::vector<char> seen(here.depth.size(), 0);
  std::vector<std::int32_t> cluster;
  for (std::size_t b = 0; b < seen.size(); ++b) {
    if (here.depth[b] >= 0 || seen[b] || here.neighbours(static_cast<std::int32_t>(b)).empty()) continue;
    cluster.assign(1, static_cast<std::int32_t>(b));
    seen[b] = 1;
    std::int32_t heaviest = cluster.front();
    for (std::size_t k = 0; k < cluster.size(); ++k) {
      if (here.graph.mass[at(cluster[k])] > here.graph.mass[at(heaviest)]) heaviest = cluster[k];
      for (const std::int32_t other : here.neighbours(cluster[k]))
        if (here.depth[at(other)] < 0 && !std::exchange(seen[at(other)], char{1})) cluster.push_back(other);
    }
    visit(cluster.size(), heaviest);
  }
}

/// Marks the heaviest body of every cluster of every part that no walk has come to. A cluster that lies in
/// several parts gets one body in each.
void mark_rest(Graph& graph) {
  graph.each([&](std::size_t p) {
    each_unreached(graph.parts[p], [&](std::size_t, std::int32_t heaviest) {
      graph.parts[p].mark[at(heaviest)] = 1;
      graph.parts[p].met.push_back(heaviest);
    });
  });
}

/// Marks the heaviest body of the largest cluster, within one part, that no walk has come to. False when all
/// of them are small.
bool mark_unreached(Graph& graph) {
  constexpr double small = 8;
  std::vector<std::int32_t> root(graph.parts.size(), -1);
  const auto find = [&](std::size_t p, std::span<double> row) {
    each_unreached(graph.parts[p], [&](std::size_t size, std::int32_t heaviest) {
      if (static_cast<double>(size) <= row[0]) return;
      row[0] = static_cast<double>(size);
      root[p] = heaviest;
    });
  };
  const std::vector<double> sizes = rows_of(graph.link, graph.parts.size(), 1, find);
  const auto most = static_cast<std::size_t>(std::ranges::max_element(sizes) - sizes.begin());
  if (sizes.empty() || sizes[most] <= small) return false;
  for (std::size_t p = 0; p < graph.parts.size(); ++p)
    if (at(graph.parts[p].graph.subdomain) == most) {
      graph.parts[p].mark[at(root[p])] = 1;
      graph.parts[p].met.push_back(root[p]);
    }
  return true;
}

/// Walks on from the bodies of the layer `depth`; returns the largest depth that it comes to.
std::int32_t walk(Graph& graph, std::int32_t depth) {
  for (;; ++depth) {
    graph.each([&](std::size_t p) {
      Layers& here = graph.parts[p];
      for (std::int32_t b : std::span(here.layer[at(depth)]).subspan(here.begun))
        for (std::int32_t other : here.neighbours(b))
          if (here.depth[at(other)] < 0 && here.mark[at(other)] == 0) {
            here.mark[at(other)] = 1;
            here.met.push_back(other);
          }
    });
    if (!take_layer(graph, depth + 1)) return depth;
  }
}

/// Returns the largest depth. Driven walls are at 0, and the heaviest body where there is none; so is one
/// body of each cluster that hangs on neither: of the few largest one by one, of the others all at once.
std::int32_t find_layers(Graph& graph) {
  constexpr int most_clusters = 8;
  graph.each([&](std::size_t p) {
    Layers& here = graph.parts[p];
    for (const auto& [first, second] : here.graph.pairs)
      if (second < 0) {
        here.mark[at(first)] = 1;
        here.met.push_back(first);
      }
  });
  std::int32_t from = 1;
  if (!take_layer(graph, from)) {
    mark_heaviest(graph);
    from = 0;
    if (!take_layer(graph, from)) return 0;
  }
  std::int32_t deepest = walk(graph, from);
  for (int clusters = 0; clusters < most_clusters && mark_unreached(graph); ++clusters) {
    take_layer(graph, 0);
    deepest = std::max(deepest, walk(graph, 0));
  }
  mark_rest(graph);
  if (take_layer(graph, 0)) deepest = std::max(deepest, walk(graph, 0));
  return deepest;
}

/// Inwards, each body hands what it carries to its contacts of the layer below, in equal parts.
void hand_on(Graph& graph, std::int32_t deepest) {
  graph.each([&](std::size_t p) {
    Layers& here = graph.parts[p];
    here.parts.resize(here.depth.size());
    for (const auto& [first, second] : here.graph.pairs) {
      if (here.below(first, second)) ++here.parts[at(first)];
      if (second >= 0 && here.below(second, first)) ++here.parts[at(second)];
    }
    here.load = here.graph.mass;
    for (std::size_t b = 0; b < here.depth.size(); ++b)
      if (here.depth[b] < 1) here.load[b] = 0;
    here.gain.resize(here.depth.size());
  });
  graph.sum_copies(&Layers::parts);
  for (std::int32_t depth = deepest; depth > 1; --depth) {
    graph.each([&](std::size_t p) {
      Layers& here = graph.parts[p];
      here.met.clear();
      for (std::int32_t b : here.layer[at(depth)])
        for (std::int32_t other : here.neighbours(b))
          if (here.depth[at(other)] == depth - 1) {
            here.gain[at(other)] += here.load[at(b)] / here.parts[at(b)];
            here.met.push_back(other);
          }
    });
    graph.sum_copies(&Layers::gain);
    graph.each([&](std::size_t p) {
      Layers& here = graph.parts[p];
      const auto take = [&](std::int32_t b) {
        here.load[at(b)] += here.gain[at(b)];
        here.gain[at(b)] = 0;
      };
      for (std::int32_t b : here.met) take(b);
      for (std::int32_t b : here.graph.shared) take(b);
    });
  }
}

}  // namespace

double estimate_stiffness(std::span<const ContactGraph> parts, const PartLink& link) {
  Graph graph(parts, link);
  hand_on(graph, find_layers(graph));
  const std::vector<double> sums = total_of(link, parts.size(), 2, [&](std::size_t p, std::span<double> row) {
    const Layers& here = graph.parts[p];
    const std::vector<double>& mass = here.graph.mass;
    for (const auto& [first, second] : here.graph.pairs) {
      double r = 0;
      if (here.below(first, second)) r = here.load[at(first)] / here.parts[at(first)];
      if (second >= 0 && here.below(second, first)) r = here.load[at(second)] / here.parts[at(second)];
      row[0] += r * r * (1 / mass[at(first)] + (second < 0 ? 0 : 1 / mass[at(second)]));
    }
    for (std::size_t b = 0; b < mass.size(); ++b)
      if (here.graph.counted(b) && here.depth[b] >= 1) row[1] += mass[b];
  });
  return sums[1] > 0 ? sums[0] / sums[1] : 0;
}

double estimate_stiffness(const BodyParts& parts) {
  std::vector<ContactGraph> graphs;
  for (std::size_t p = 0; p < parts.size(); ++p) graphs.push_back(graph_of(parts[p]));
  return estimate_stiffness(graphs, parts.link());
}

double estimate_stiffness(const BodyProblem& problem) {
  const PartLink alone;
  return estimate_stiffness(BodyParts({&problem, 1}, alone));
}

double stiffness_of_cell(double layers, double spread, const CellStiffness& of) {
  return layers * std::max(layers, spread / of.contacts);
}

}  // namespace talus
