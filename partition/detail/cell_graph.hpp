#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "partition/partitioner.hpp"

namespace talus::detail {

/// How a grid of cells goes on behind its faces, in a periodic cell.
struct CellRing {
  std::array<bool, 3> closes{};  ///< along x, y, z; only with three cells or more, so that neighbours differ
  std::int32_t xy = 0, xz = 0, yz = 0;  ///< by how many cells the face behind is displaced (PeriodicSpace)
};

/// Weighted grid of cells over a frame, summed over all ranks. An edge joins a cell to one of its 26
/// neighbours; it is kept at the cell that comes first, or stands before a face that the grid closes at.
struct CellGraph {
  std::array<std::int32_t, 3> cells{};
  CellRing ring;
  std::vector<std::int64_t> weight;  ///< per cell: sum of the weights of its points
  std::vector<std::int64_t>
      shared;  ///< 13 per cell, for the neighbours `half_neighbours`: see build_cell_graph
};

/// The neighbours that follow a cell in order of (z, y, x).
inline constexpr std::array<std::array<std::int32_t, 3>, 13> half_neighbours = {{{1, 0, 0},
                                                                                 {-1, 1, 0},
                                                                                 {0, 1, 0},
                                                                                 {1, 1, 0},
                                                                                 {-1, -1, 1},
                                                                                 {0, -1, 1},
                                                                                 {1, -1, 1},
                                                                                 {-1, 0, 1},
                                                                                 {0, 0, 1},
                                                                                 {1, 0, 1},
                                                                                 {-1, 1, 1},
                                                                                 {0, 1, 1},
                                                                                 {1, 1, 1}}};

/// Cells with weight per subdomain that suffice. Of 90 to 2000 none gave METIS a better cut; the fewer, the
/// faster and the smaller the sums over ranks. Parts are balanced to about one cell.
inline constexpr std::int64_t cells_per_subdomain = 128;

/// The grid that build_cell_graph works on, without subdomains, and the weight of each cell over all ranks.
CellTable choose_cells(const PartitionPoints& points, const IntegerFrame& frame, std::int64_t wanted,
                       const Reduction& reduction, std::vector<std::int64_t>& weight);

/// Cells of roughly cubic shape, as large as leaves `wanted` of them with weight, but at most 2^18 in all.
/// A point weighs on the cell it lies in. Its two bodies tie that cell to the cells of their centres: a cut
/// between the two is likely to leave the body with contacts on both sides. So an edge counts the bodies that
/// two cells share once per contact across it; unlike a count of bodies it is a sum over candidates, that
/// every rank can begin without knowing the candidates of another. A centre further away than a neighbour
/// ties to the neighbour on the way, and one beyond a face of a periodic domain to the cell behind it.
CellGraph build_cell_graph(const PartitionPoints& points, const IntegerFrame& frame, std::int64_t wanted,
                           const Reduction& reduction, const Domain& domain = {});

/// Cells to n subdomains by METIS_PartGraphKway, with a fixed seed, on the first rank, whose answer all get.
/// Cells without weight go to the subdomain of the nearest cell (in steps through faces) that has some.
/// Throws std::runtime_error if METIS fails. While METIS runs it holds the process's SIGTERM and SIGABRT
/// handlers.
CellTable cut_cell_graph(const CellGraph& graph, std::int32_t n, const Reduction& reduction);

/// Renumbers the subdomains of `table`: greedily, by falling weight in common with a subdomain of `previous`
/// (ties: lower old, then lower new number).
void keep_numbers(CellTable& table, const Partition& previous, const PartitionPoints& points,
                  const IntegerFrame& frame, std::int32_t n, const Reduction& reduction);

}  // namespace talus::detail
