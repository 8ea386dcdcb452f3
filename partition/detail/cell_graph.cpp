#include "partition/detail/cell_graph.hpp"

#include <metis.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <stdexcept>
#include <string>
#include <tuple>

#include "kernels/bodies/index.hpp"

namespace talus::detail {

namespace {

constexpr std::int64_t most_cells = 1 << 18;

CellTable empty_table(const IntegerFrame& frame, double cells) {
  // Edge of a cube of which `cells` fill the box. Axes shorter than it get one cell, and the others all.
  std::array<bool, 3> flat{};
  for (;;) {
    double volume = 1;
    int axes = 0;
    for (std::size_t k = 0; k < 3; ++k)
      if (!flat[k] && frame.lengths[static_cast<Eigen::Index>(k)] > 0) {
        volume *= frame.lengths[static_cast<Eigen::Index>(k)];
        ++axes;
      }
    const double edge = axes > 0 ? std::pow(volume / cells, 1.0 / axes) : 1;
    CellTable table;
    bool flatter = false;
    for (std::size_t k = 0; k < 3; ++k) {
      const double across = flat[k] ? 0 : frame.lengths[static_cast<Eigen::Index>(k)] / edge;
      flatter = flatter || (across > 0 && across < 1);
      flat[k] = across < 1;
      table.cells[k] = static_cast<std::int32_t>(std::clamp(std::floor(across), 1.0, 4096.0));
    }
    if (!flatter) return table;
  }
}

std::int64_t size_of(const CellTable& table) {
  return std::int64_t{table.cells[0]} * table.cells[1] * table.cells[2];
}

std::array<std::int32_t, 3> place_of(const CellTable& table, std::size_t cell) {
  const auto nx = at(table.cells[0]), ny = at(table.cells[1]);
  return {static_cast<std::int32_t>(cell % nx), static_cast<std::int32_t>(cell / nx % ny),
          static_cast<std::int32_t>(cell / (nx * ny))};
}

/// Cell next to `place` in a direction of -1, 0, 1 per axis, or -1 outside a grid that does not close there.
/// Back from there in the other direction is `place`.
std::int64_t neighbour(const CellTable& table, const CellRing& ring, std::array<std::int32_t, 3> place,
                       const std::array<std::int32_t, 3>& direction) {
  // What leaves through the upper face along an axis comes in at the lower one, and as far back along the
  // axes before as that face is displaced.
  const std::array<std::array<std::int32_t, 2>, 3> leans{{{0, 0}, {ring.xy, 0}, {ring.xz, ring.yz}}};
  for (std::size_t k = 3; k-- > 0;) {
    place[k] += direction[k];
    if (place[k] >= 0 && place[k] < table.cells[k]) continue;
    if (!ring.closes[k]) return -1;
    const std::int32_t turns =
        place[k] < 0 ? -((table.cells[k] - 1 - place[k]) / table.cells[k]) : place[k] / table.cells[k];
    place[k] -= turns * table.cells[k];
    for (std::size_t j = 0; j < 2 && j < k; ++j) place[j] -= turns * leans[k][j];
  }
  return place[0] + std::int64_t{table.cells[0]} * (place[1] + std::int64_t{table.cells[1]} * place[2]);
}

CellRing ring_of(const CellTable& table, const IntegerFrame& frame, const Domain& domain) {
  CellRing ring;
  const Vec3 edges = domain.edges();
  const auto in_cells = [&](double length, Eigen::Index axis) {
    return ring.closes[at(axis)]
               ? static_cast<std::int32_t>(std::lround(length / frame.lengths[axis] * table.cells[at(axis)]))
               : 0;
  };
  for (const Eigen::Index axis : {0, 1, 2})
    ring.closes[at(axis)] = edges[axis] > 0 && table.cells[at(axis)] > 2;
  ring.xy = in_cells(domain.cell.xy, 0);
  ring.xz = in_cells(domain.cell.xz, 0);
  ring.yz = in_cells(domain.cell.yz, 1);
  return ring;
}

/// The graph of the cells with weight, as METIS reads it; its weights are 32-bit.
struct Compressed {
  std::vector<std::int32_t> cell;  ///< of vertex
  std::vector<idx_t> begin{0}, to, vertex_weight, edge_weight;
};

Compressed compress(const CellGraph& graph, const CellTable& table) {
  Compressed result;
  std::vector<idx_t> vertex(graph.weight.size(), -1);
  std::int64_t total = 0;
  for (std::size_t c = 0; c < graph.weight.size(); ++c) {
    total += graph.weight[c];
    if (graph.weight[c] == 0) continue;
    vertex[c] = static_cast<idx_t>(result.cell.size());
    result.cell.push_back(static_cast<std::int32_t>(c));
    result.vertex_weight.push_back(static_cast<idx_t>(graph.weight[c]));
  }
  // Grains without candidates yet (the first partition of a run) share nothing: cells are then tied by their
  // faces, all with the same weight. Without ties METIS scatters the cells of a subdomain over the box.
  const bool tied =
      std::any_of(graph.shared.begin(), graph.shared.end(), [](std::int64_t s) { return s > 0; });
  const auto shared_by = [&](std::size_t cell, std::size_t d) {
    if (tied) return graph.shared[13 * cell + d];
    const auto& step = half_neighbours[d];
    return std::int64_t{std::abs(step[0]) + std::abs(step[1]) + std::abs(step[2]) == 1};
  };
  std::int64_t scale = 1;  // two ties a point: their sum may reach twice the weight, METIS adds further
  for (std::int64_t shared : graph.shared) total += shared;
  while (total / scale >= std::numeric_limits<idx_t>::max() / 4) scale *= 2;
  for (const std::int32_t cell : result.cell) {
    const auto place = place_of(table, at(cell));
    const auto tie = [&](std::int64_t other, std::int64_t shared) {
      if (other < 0 || vertex[at(other)] < 0 || shared == 0) return;
      result.to.push_back(vertex[at(other)]);
      result.edge_weight.push_back(static_cast<idx_t>((shared + scale - 1) / scale));
    };
    for (std::size_t d = 0; d < half_neighbours.size(); ++d) {
      const auto& step = half_neighbours[d];
      const std::int64_t before = neighbour(table, graph.ring, place, {-step[0], -step[1], -step[2]});
      if (before >= 0) tie(before, shared_by(at(before), d));
      tie(neighbour(table, graph.ring, place, step), shared_by(at(cell), d));
    }
    result.begin.push_back(static_cast<idx_t>(result.to.size()));
  }
  return result;
}

bool connected(const Compressed& graph) {
  std::vector<char> seen(graph.cell.size(), 0);
  std::vector<idx_t> front{0};
  seen[0] = 1;
  std::size_t reached = 1;
  while (!front.empty()) {
    const auto v = at(front.back());
    front.pop_back();
    for (auto e = graph.begin[v]; e < graph.begin[v + 1]; ++e) {
      const idx_t other = graph.to[at(e)];
      if (seen[at(other)] != 0) continue;
      seen[at(other)] = 1;
      ++reached;
      front.push_back(other);
    }
  }
  return reached == graph.cell.size();
}

std::vector<idx_t> call_metis(Compressed& graph, std::int32_t n) {
  idx_t vertices = static_cast<idx_t>(graph.cell.size()), constraints = 1, parts = n, cut = 0;
  std::vector<idx_t> part(graph.cell.size(), 0);
  std::array<idx_t, METIS_NOPTIONS> options;
  METIS_SetDefaultOptions(options.data());
  options[METIS_OPTION_SEED] = 1;
  options[METIS_OPTION_UFACTOR] = 5;  // parts up to 0.5 % above the mean
  options[METIS_OPTION_NITER] = 20;
  options[METIS_OPTION_NCUTS] = 4;  // the best of four: 2 % fewer bodies in the largest interface
  options[METIS_OPTION_CONTIG] = connected(graph) ? 1 : 0;
  const int status = METIS_PartGraphKway(&vertices, &constraints, graph.begin.data(), graph.to.data(),
                                         graph.vertex_weight.data(), nullptr, graph.edge_weight.data(),
                                         &parts, nullptr, nullptr, options.data(), &cut, part.data());
  if (status != METIS_OK)
    throw std::runtime_error("partition: METIS failed with status " + std::to_string(status) + " on " +
                             std::to_string(vertices) + " cells and " + std::to_string(n) +
                             " subdomains; take the partitioner rcb");
  return part;
}

}  // namespace

CellTable choose_cells(const PartitionPoints& points, const IntegerFrame& frame, std::int64_t wanted,
                       const Reduction& reduction, std::vector<std::int64_t>& weight) {
  CellTable table;
  for (double cells = static_cast<double>(std::min(wanted, most_cells));; cells *= 2) {
    table = empty_table(frame, cells);
    weight.assign(at(size_of(table)), 0);
    for (std::size_t k = 0; k < points.x.size(); ++k)
      weight[table.cell_of(frame.coordinates(points.x[k]))] += points.weight.empty() ? 1 : points.weight[k];
    reduction.sum(weight);
    const auto occupied =
        static_cast<std::int64_t>(weight.size()) - std::count(weight.begin(), weight.end(), std::int64_t{0});
    if (occupied >= wanted || 2 * cells > static_cast<double>(most_cells)) return table;
  }
}

CellGraph build_cell_graph(const PartitionPoints& points, const IntegerFrame& frame, std::int64_t wanted,
                           const Reduction& reduction, const Domain& domain) {
  CellGraph graph;
  const CellTable table = choose_cells(points, frame, wanted, reduction, graph.weight);
  graph.cells = table.cells;
  graph.ring = ring_of(table, frame, domain);
  const Vec3 low = domain.low, high = low + domain.edges();
  graph.shared.assign(13 * graph.weight.size(), 0);
  for (std::size_t k = 0; k < points.x.size(); ++k) {
    const std::int64_t weight = points.weight.empty() ? 1 : points.weight[k];
    const std::size_t own = table.cell_of(frame.coordinates(points.x[k]));
    const auto place = place_of(table, own);
    for (const double side : {1.0, -1.0}) {
      const Vec3 centre = points.x[k] + side * points.half[k];
      const auto target = place_of(table, table.cell_of(frame.coordinates(centre)));
      std::array<std::int32_t, 3> step;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto e = static_cast<Eigen::Index>(axis);
        step[axis] = std::clamp(target[axis] - place[axis], -1, 1);
        if (graph.ring.closes[axis] && centre[e] < low[e]) step[axis] = -1;
        if (graph.ring.closes[axis] && centre[e] >= high[e]) step[axis] = 1;
      }
      if (step == std::array<std::int32_t, 3>{}) continue;
      const bool forward = std::tuple(step[2], step[1], step[0]) > std::tuple(0, 0, 0);
      const std::size_t from = forward ? own : at(neighbour(table, graph.ring, place, step));
      if (!forward) step = {-step[0], -step[1], -step[2]};
      const auto d =
          std::find(half_neighbours.begin(), half_neighbours.end(), step) - half_neighbours.begin();
      graph.shared[13 * from + at(d)] += weight;
    }
  }
  reduction.sum(graph.shared);
  return graph;
}

CellTable cut_cell_graph(const CellGraph& graph, std::int32_t n, const Reduction& reduction) {
  CellTable table{graph.cells, {}};
  // The answer of one rank, so that no difference between builds of METIS can part the ranks; others add 0.
  std::vector<std::int64_t> part(graph.weight.size(), 0);
  if (reduction.first) {
    Compressed compressed = compress(graph, table);
    const bool one_each = static_cast<std::int64_t>(compressed.cell.size()) <= n;
    std::vector<idx_t> found;
    if (!one_each && n > 1) found = call_metis(compressed, n);
    for (std::size_t v = 0; v < compressed.cell.size(); ++v)
      part[at(compressed.cell[v])] = n == 1 ? 0 : one_each ? static_cast<std::int64_t>(v) : found[v];
  }
  reduction.sum(part);
  table.subdomain.assign(part.begin(), part.end());

  std::vector<std::size_t> front;
  for (std::size_t c = 0; c < graph.weight.size(); ++c)
    if (graph.weight[c] > 0)
      front.push_back(c);
    else
      table.subdomain[c] = -1;
  if (front.empty()) table.subdomain.assign(table.subdomain.size(), 0);
  constexpr std::array<std::array<std::int32_t, 3>, 6> faces = {
      {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}}};
  for (std::size_t k = 0; k < front.size(); ++k)
    for (const auto& face : faces) {
      const std::int64_t other = neighbour(table, graph.ring, place_of(table, front[k]), face);
      if (other < 0 || table.subdomain[at(other)] >= 0) continue;
      table.subdomain[at(other)] = table.subdomain[front[k]];
      front.push_back(at(other));
    }
  return table;
}

void keep_numbers(CellTable& table, const Partition& previous, const PartitionPoints& points,
                  const IntegerFrame& frame, std::int32_t n, const Reduction& reduction) {
  std::vector<std::int64_t> common(at(n) * at(n), 0);
  for (std::size_t k = 0; k < points.x.size(); ++k) {
    const auto before = previous.subdomain_of(points.x[k]).at();
    const auto now = at(table.subdomain[table.cell_of(frame.coordinates(points.x[k]))]);
    common[before * at(n) + now] += points.weight.empty() ? 1 : points.weight[k];
  }
  reduction.sum(common);
  struct Match {
    std::int64_t weight;
    std::int32_t before, now;
  };
  std::vector<Match> matches;
  for (std::int32_t before = 0; before < n; ++before)
    for (std::int32_t now = 0; now < n; ++now)
      if (const auto weight = common[at(before) * at(n) + at(now)]; weight > 0)
        matches.push_back({weight, before, now});
  std::sort(matches.begin(), matches.end(), [](const Match& a, const Match& b) {
    return std::tuple(-a.weight, a.before, a.now) < std::tuple(-b.weight, b.before, b.now);
  });
  std::vector<std::int32_t> number(at(n), -1);
  std::vector<char> taken(at(n), 0);
  const auto give = [&](std::int32_t before, std::int32_t now) {
    if (taken[at(before)] != 0 || number[at(now)] >= 0) return;
    number[at(now)] = before;
    taken[at(before)] = 1;
  };
  for (const Match& match : matches) give(match.before, match.now);
  std::int32_t free = 0;
  for (std::int32_t now = 0; now < n; ++now) {
    while (free < n && taken[at(free)] != 0) ++free;
    if (number[at(now)] < 0) give(free, now);
  }
  for (std::int32_t& subdomain : table.subdomain) subdomain = number[at(subdomain)];
}

}  // namespace talus::detail
