#include "io/results/cell_outline.hpp"

#include "runtime/step/cell_flow.hpp"

namespace talus::io {

std::optional<CellBox> cell_box(const Domain& domain, const Bounds& grains) {
  if (!domain.repeats) return std::nullopt;
  CellBox box{domain.low, edges_of(domain), {}};
  for (const Eigen::Index axis : {0, 1, 2}) {
    box.repeats[static_cast<std::size_t>(axis)] = box.edges(axis, axis) > 0;
    if (box.edges(axis, axis) > 0 || !(grains.low[axis] <= grains.high[axis])) continue;
    box.low[axis] = grains.low[axis];
    box.edges(axis, axis) = grains.high[axis] - grains.low[axis];
  }
  return box;
}

std::vector<CellLine> cell_lines(const CellBox& cell) {
  std::vector<CellLine> lines;
  const auto corner = [&](int number) {
    Vec3 at = cell.low;
    for (int axis = 0; axis < 3; ++axis)
      if ((number >> axis & 1) != 0) at[axis] += cell.edges(axis, axis);
    return at;
  };
  for (int axis = 0; axis < 3; ++axis)
    for (int from = 0; from < 8; ++from)
      if ((from >> axis & 1) == 0) lines.push_back({{corner(from), corner(from | 1 << axis)}});
  if (cell.leans())
    for (int axis = 0; axis < 3; ++axis)
      lines.push_back({{cell.low, cell.low + cell.edges.col(axis)}, axis + 1});
  return lines;
}

}  // namespace talus::io
