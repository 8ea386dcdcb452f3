#include "kernels/global/stiffness.hpp"

#include <algorithm>
#include <utility>

#include "kernels/bodies/index.hpp"

namespace talus {

namespace {

/// One part's bodies by their distance over contacts from the driven walls.
struct Layers {
  const ContactGraph& graph;
  std::vector<std::size_t> begin;                ///< per unknown + 1, into `other`
  std::vector<std::int32_t> other;               ///< neighbours, in order of contact
  std::vector<std::int32_t> depth;               ///< per unknown; -1: not reached
  std::vector<std::vector<std::int32_t>> layer;  ///< unknowns by depth
  std::size_t begun = 0;                         ///< where the new unknowns of the layer taken last begin
  std::vector<std::int32_t> met;                 ///< unknowns whose mark may have been set
  std::vector<double> parts, load;               ///< contacts with the layer below; what is handed on [kg]

  explicit Layers(const ContactGraph& of)
      : graph(of), begin(of.mass.size() + 1, 0), depth(of.mass.size(), -1) {
    for (const auto& [first, second] : graph.pairs)
      if (second >= 0) {
        ++begin[at(first) + 1];
        ++begin[at(second) + 1];
      }
    for (std::size_t b = 0; b + 1 < begin.size(); ++b) begin[b + 1] += begin[b];
    other.resize(begin.back());
    std::vector<std::size_t> next(begin.begin(), begin.end() - 1);
    for (const auto& [first, second] : graph.pairs)
      if (second >= 0) {
        other[next[at(first)]++] = second;
        other[next[at(second)]++] = first;
      }
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

  Graph(std::span<const ContactGraph> graphs, const PartLink& of) : link(of) {
    for (const ContactGraph& graph : graphs) parts.emplace_back(graph);
  }
  PartField field() const {
    PartField field;
    for (const Layers& part : parts) field.emplace_back(part.depth.size());
    return field;
  }
  void each(const std::function<void(std::size_t)>& work) const { link.each(parts.size(), work); }
};

/// Unknowns marked in any part that have no depth yet become the layer `depth`. False when there are none.
bool take_layer(Graph& graph, PartField& mark, std::int32_t depth) {
  graph.link.sum_copies(mark);
  return total_of(graph.link, graph.parts.size(), 1, [&](std::size_t p, std::span<double> row) {
           Layers& here = graph.parts[p];
           if (here.layer.size() <= at(depth)) here.layer.resize(at(depth) + 1);
           std::vector<std::int32_t>& layer = here.layer[at(depth)];
           here.begun = layer.size();
           const auto take = [&](std::int32_t b) {
             if (mark[p][at(b)].u[0] > 0 && here.depth[at(b)] < 0) {
               here.depth[at(b)] = depth;
               layer.push_back(b);
             }
             mark[p][at(b)].u[0] = 0;
           };
           for (std::int32_t b : here.met) take(b);
           for (std::int32_t b : here.graph.shared) take(b);
           here.met.clear();
           row[0] = static_cast<double>(layer.size() - here.begun);
         })[0] > 0;
}

/// Without a driven wall the walk begins at the heaviest body that touches another, on which the others come
/// to rest.
void mark_heaviest(Graph& graph, PartField& mark) {
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
      mark[p][heaviest[p]].u[0] = 1;
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
void mark_rest(Graph& graph, PartField& mark) {
  graph.each([&](std::size_t p) {
    each_unreached(graph.parts[p], [&](std::size_t, std::int32_t heaviest) {
      mark[p][at(heaviest)].u[0] = 1;
      graph.parts[p].met.push_back(heaviest);
    });
  });
}

/// Marks the heaviest body of the largest cluster, within one part, that no walk has come to. False when all
/// of them are small.
bool mark_unreached(Graph& graph, PartField& mark) {
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
      mark[p][at(root[p])].u[0] = 1;
      graph.parts[p].met.push_back(root[p]);
    }
  return true;
}

/// Walks on from the bodies of the layer `depth`; returns the largest depth that it comes to.
std::int32_t walk(Graph& graph, PartField& mark, std::int32_t depth) {
  for (;; ++depth) {
    graph.each([&](std::size_t p) {
      Layers& here = graph.parts[p];
      for (std::int32_t b : std::span(here.layer[at(depth)]).subspan(here.begun))
        for (std::int32_t other : here.neighbours(b))
          if (here.depth[at(other)] < 0 && mark[p][at(other)].u[0] == 0) {
            mark[p][at(other)].u[0] = 1;
            here.met.push_back(other);
          }
    });
    if (!take_layer(graph, mark, depth + 1)) return depth;
  }
}

/// Returns the largest depth. Driven walls are at 0, and the heaviest body where there is none; so is one
/// body of each cluster that hangs on neither: of the few largest one by one, of the others all at once.
std::int32_t find_layers(Graph& graph) {
  constexpr int most_clusters = 8;
  PartField mark = graph.field();
  graph.each([&](std::size_t p) {
    Layers& here = graph.parts[p];
    for (const auto& [first, second] : here.graph.pairs)
      if (second < 0) {
        mark[p][at(first)].u[0] = 1;
        here.met.push_back(first);
      }
  });
  std::int32_t from = 1;
  if (!take_layer(graph, mark, from)) {
    mark_heaviest(graph, mark);
    from = 0;
    if (!take_layer(graph, mark, from)) return 0;
  }
  std::int32_t deepest = walk(graph, mark, from);
  for (int clusters = 0; clusters < most_clusters && mark_unreached(graph, mark); ++clusters) {
    take_layer(graph, mark, 0);
    deepest = std::max(deepest, walk(graph, mark, 0));
  }
  mark_rest(graph, mark);
  if (take_layer(graph, mark, 0)) deepest = std::max(deepest, walk(graph, mark, 0));
  return deepest;
}

/// Inwards, each body hands what it carries to its contacts of the layer below, in equal parts.
void hand_on(Graph& graph, std::int32_t deepest) {
  PartField gain = graph.field();
  graph.each([&](std::size_t p) {
    const Layers& here = graph.parts[p];
    for (const auto& [first, second] : here.graph.pairs) {
      if (here.below(first, second)) ++gain[p][at(first)].u[0];
      if (second >= 0 && here.below(second, first)) ++gain[p][at(second)].u[0];
    }
  });
  graph.link.sum_copies(gain);
  graph.each([&](std::size_t p) {
    Layers& here = graph.parts[p];
    for (std::size_t b = 0; b < here.depth.size(); ++b) {
      here.parts.push_back(gain[p][b].u[0]);
      here.load.push_back(here.depth[b] >= 1 ? here.graph.mass[b] : 0);
      gain[p][b] = Twist{};
    }
  });
  for (std::int32_t depth = deepest; depth > 1; --depth) {
    graph.each([&](std::size_t p) {
      Layers& here = graph.parts[p];
      here.met.clear();
      for (std::int32_t b : here.layer[at(depth)])
        for (std::int32_t other : here.neighbours(b))
          if (here.depth[at(other)] == depth - 1) {
            gain[p][at(other)].u[0] += here.load[at(b)] / here.parts[at(b)];
            here.met.push_back(other);
          }
    });
    graph.link.sum_copies(gain);
    graph.each([&](std::size_t p) {
      Layers& here = graph.parts[p];
      const auto take = [&](std::int32_t b) {
        here.load[at(b)] += gain[p][at(b)].u[0];
        gain[p][at(b)].u[0] = 0;
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
