#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kernels/bodies/types.hpp"

namespace talus {

/// Two grains near enough to touch before the next broad phase; first < second.
struct GrainPair {
  Slot first;
  Slot second;
  bool operator==(const GrainPair&) const = default;
};

/// Grid of several levels: a body stands in the finest level whose cells are twice its reach or wider, so
/// that a sample with radii 1 : 100 costs no more than an even one. A pair is found from its smaller body, in
/// the 27 cells of the larger one's level; in one level, from half of the 26 neighbours. Cells are sorted,
/// with three in a row along z side by side. So the neighbours of a cell are a few rows of bodies, and no
/// table is looked up.
struct CellGrid {
  struct Cell {
    std::uint64_t key;   ///< level, x, y, z
    std::int32_t begin;  ///< into `slots`
    std::int32_t end;
  };
  struct Member {
    double x[3];   ///< [m]
    double reach;  ///< [m]
  };
  Vec3 origin = Vec3::Zero();     ///< in the middle of the centres [m]
  std::vector<double> cell_size;  ///< per level [m], doubling; wider where bodies lie so far apart that
                                  ///< cells could not be counted
  std::vector<Slot> slots;        ///< all bodies, sorted by (level, cell, slot)
  std::vector<Member> members;    ///< likewise
  std::vector<Cell> cells;        ///< non-empty cells in order of key; sorted like `slots`
};

/// Sorts bodies into cells. `x` [m] and `reach` [m] have one entry per slot; reach > 0 and finite, x finite.
/// Two bodies are candidates when |x_i - x_j| < reach_i + reach_j.
CellGrid build_cells(std::span<const Vec3> x, std::span<const double> reach);

/// Appends to `pairs` the candidates found from the cells [begin, end) of `grid`, in no promised order; over
/// all cells every pair comes exactly once.
void find_pairs(const CellGrid& grid, std::size_t begin, std::size_t end, std::vector<GrainPair>& pairs);

/// Whether a sphere of this reach [m] about x [m] overlaps the reach of any body of the grid.
bool meets_any(const CellGrid& grid, const Vec3& x, double reach);

/// All pairs of `parts` in order of (first, second), by counting: the order does not depend on how cells were
/// dealt to the parts.
std::vector<GrainPair> sort_pairs(std::span<const std::vector<GrainPair>> parts, std::size_t bodies);

}  // namespace talus
