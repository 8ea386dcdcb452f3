#include "kernels/broad_phase.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "kernels/morton.hpp"

namespace talus {

namespace {

constexpr int level_shift = 58;               // above 3 x 19 bits of Morton key
constexpr std::int32_t half_cells = 1 << 18;  // cells on each side of the origin, per axis
/// Cells are wider than the widest pair by more than the rounding of a quotient up to half_cells, so that a
/// pair is never two cells apart.
constexpr double rounding_margin = 1 + 1e-9;

using Coordinates = std::array<std::int32_t, 3>;

/// Cell of a point in a level, in 0 .. 2 half_cells - 1. Far coordinates are clamped into the outermost cell,
/// which keeps neighbours neighbours.
Coordinates cell_of(const Vec3& x, const Vec3& origin, double size) {
  Coordinates c;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto axis = static_cast<Eigen::Index>(k);
    const double cell = std::floor((x[axis] - origin[axis]) / size);
    c[k] = half_cells + static_cast<std::int32_t>(std::clamp<double>(cell, -half_cells, half_cells - 1));
  }
  return c;
}

/// Medians of the coordinates: a few bodies that fly far away must not push all others into one clamped cell.
Vec3 median(std::span<const Vec3> x) {
  std::vector<double> values(x.size());
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(x.size() / 2);
  Vec3 result;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    std::transform(x.begin(), x.end(), values.begin(), [axis](const Vec3& p) { return p[axis]; });
    std::nth_element(values.begin(), middle, values.end());
    result[axis] = *middle;
  }
  return result;
}

std::uint64_t cell_key(std::uint64_t level, const Coordinates& c) {
  return level << level_shift | morton_key(static_cast<std::uint32_t>(c[0]), static_cast<std::uint32_t>(c[1]),
                                           static_cast<std::uint32_t>(c[2]));
}

std::size_t hash(std::uint64_t key, std::size_t mask) {
  return static_cast<std::size_t>((key * 0x9e3779b97f4a7c15ULL) >> 32) & mask;
}

const CellGrid::Cell* find_cell(const CellGrid& grid, std::uint64_t key) {
  const std::size_t mask = grid.table.size() - 1;
  for (std::size_t h = hash(key, mask);; h = (h + 1) & mask) {
    const std::int32_t index = grid.table[h];
    if (index < 0) return nullptr;
    const CellGrid::Cell& cell = grid.cells[static_cast<std::size_t>(index)];
    if (cell.key == key) return &cell;
  }
}

bool inside(const Coordinates& c) {
  for (std::int32_t k : c)
    if (k < 0 || k >= 2 * half_cells) return false;
  return true;
}

/// The 13 neighbours that stand after the centre in lexicographic order.
constexpr std::array<std::array<int, 3>, 13> half_neighbours = {{{0, 0, 1},
                                                                 {0, 1, -1},
                                                                 {0, 1, 0},
                                                                 {0, 1, 1},
                                                                 {1, -1, -1},
                                                                 {1, -1, 0},
                                                                 {1, -1, 1},
                                                                 {1, 0, -1},
                                                                 {1, 0, 0},
                                                                 {1, 0, 1},
                                                                 {1, 1, -1},
                                                                 {1, 1, 0},
                                                                 {1, 1, 1}}};

}  // namespace

CellGrid build_cells(std::span<const Vec3> x, std::span<const double> reach) {
  CellGrid grid;
  const std::size_t n = x.size();
  if (n == 0) {
    grid.table.assign(1, -1);
    return grid;
  }
  double smallest = reach[0], largest = reach[0];
  grid.origin = median(x);
  for (double r : reach) {
    smallest = std::min(smallest, r);
    largest = std::max(largest, r);
  }
  // The coarsest level is fitted to the largest body; even samples then have one level and cells that are not
  // too large.
  // In floating point up to the bound: a reach may be infinite in a step that ends as a runaway.
  const int levels = 1 + static_cast<int>(std::min(31.0, std::floor(std::log2(largest / smallest))));
  grid.cell_size.resize(static_cast<std::size_t>(levels));
  for (int level = 0; level < levels; ++level)
    grid.cell_size[static_cast<std::size_t>(level)] =
        2 * largest * std::exp2(level - levels + 1) * rounding_margin;

  struct Entry {
    std::uint64_t key;
    Slot slot;
  };
  std::vector<Entry> entries(n);
  for (std::size_t k = 0; k < n; ++k) {
    std::size_t level = 0;
    while (grid.cell_size[level] < 2 * reach[k]) ++level;
    entries[k] = {cell_key(level, cell_of(x[k], grid.origin, grid.cell_size[level])), static_cast<Slot>(k)};
  }
  std::sort(entries.begin(), entries.end(),
            [](const Entry& a, const Entry& b) { return a.key != b.key ? a.key < b.key : a.slot < b.slot; });

  grid.slots.resize(n);
  for (std::size_t k = 0; k < n; ++k) {
    grid.slots[k] = entries[k].slot;
    const auto at = static_cast<std::int32_t>(k);
    if (k == 0 || entries[k].key != entries[k - 1].key) grid.cells.push_back({entries[k].key, at, at});
    grid.cells.back().end = at + 1;
  }
  grid.table.assign(std::bit_ceil(2 * grid.cells.size() + 1), -1);
  const std::size_t mask = grid.table.size() - 1;
  for (std::size_t k = 0; k < grid.cells.size(); ++k) {
    std::size_t h = hash(grid.cells[k].key, mask);
    while (grid.table[h] >= 0) h = (h + 1) & mask;
    grid.table[h] = static_cast<std::int32_t>(k);
  }
  return grid;
}

void find_pairs(const CellGrid& grid, std::span<const Vec3> x, std::span<const double> reach,
                std::size_t begin, std::size_t end, std::vector<GrainPair>& pairs) {
  const auto test = [&](Slot a, Slot b) {
    const auto i = static_cast<std::size_t>(a), j = static_cast<std::size_t>(b);
    const double distance = reach[i] + reach[j];
    if ((x[i] - x[j]).squaredNorm() < distance * distance)
      pairs.push_back(a < b ? GrainPair{a, b} : GrainPair{b, a});
  };
  const auto slots_of = [&](const CellGrid::Cell& cell) {
    return std::span(grid.slots)
        .subspan(static_cast<std::size_t>(cell.begin), static_cast<std::size_t>(cell.end - cell.begin));
  };
  for (std::size_t c = begin; c < end; ++c) {
    const auto here = slots_of(grid.cells[c]);
    const std::uint64_t level = grid.cells[c].key >> level_shift;
    const Vec3& any = x[static_cast<std::size_t>(here[0])];
    const Coordinates at = cell_of(any, grid.origin, grid.cell_size[level]);
    for (std::size_t a = 0; a < here.size(); ++a)
      for (std::size_t b = a + 1; b < here.size(); ++b) test(here[a], here[b]);
    for (const auto& offset : half_neighbours) {
      const Coordinates near = {at[0] + offset[0], at[1] + offset[1], at[2] + offset[2]};
      if (!inside(near)) continue;
      const CellGrid::Cell* cell = find_cell(grid, cell_key(level, near));
      if (cell == nullptr) continue;
      for (Slot a : here)
        for (Slot b : slots_of(*cell)) test(a, b);
    }
    for (std::uint64_t coarse = level + 1; coarse < grid.cell_size.size(); ++coarse) {
      for (Slot a : here) {
        const Coordinates centre =
            cell_of(x[static_cast<std::size_t>(a)], grid.origin, grid.cell_size[coarse]);
        for (int code = 0; code < 27; ++code) {
          const Coordinates near = {centre[0] + code / 9 - 1, centre[1] + code / 3 % 3 - 1,
                                    centre[2] + code % 3 - 1};
          if (!inside(near)) continue;
          const CellGrid::Cell* cell = find_cell(grid, cell_key(coarse, near));
          if (cell == nullptr) continue;
          for (Slot b : slots_of(*cell)) test(a, b);
        }
      }
    }
  }
}

std::vector<GrainPair> sort_pairs(std::span<const std::vector<GrainPair>> parts, std::size_t bodies) {
  std::vector<std::int32_t> offset(bodies + 1, 0);
  for (const auto& part : parts)
    for (const GrainPair& pair : part) ++offset[static_cast<std::size_t>(pair.first) + 1];
  for (std::size_t k = 0; k < bodies; ++k) offset[k + 1] += offset[k];
  std::vector<GrainPair> sorted(static_cast<std::size_t>(offset[bodies]));
  std::vector<std::int32_t> next(offset.begin(), offset.end() - 1);
  for (const auto& part : parts)
    for (const GrainPair& pair : part)
      sorted[static_cast<std::size_t>(next[static_cast<std::size_t>(pair.first)]++)] = pair;
  for (std::size_t k = 0; k < bodies; ++k)
    std::sort(sorted.begin() + offset[k], sorted.begin() + offset[k + 1],
              [](const GrainPair& a, const GrainPair& b) { return a.second < b.second; });
  return sorted;
}

}  // namespace talus
