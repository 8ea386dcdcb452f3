#pragma once

/// A periodic cell as lines, for pictures and viewers.

#include <array>
#include <optional>
#include <vector>

#include "kernels/bodies/types.hpp"
#include "kernels/detection/domain.hpp"
#include "kernels/shapes/surface.hpp"

namespace talus::io {

/// Where a periodic cell stands. Along axes of walls it reaches as far as the grains do.
struct CellBox {
  Vec3 low = Vec3::Zero();  ///< lower corner [m]
  Mat3 edges =
      Mat3::Zero();  ///< a, b, c as columns [m]; the diagonal has those of the brick of stored points
  std::array<bool, 3> repeats{};

  bool leans() const { return edges(0, 1) != 0 || edges(0, 2) != 0 || edges(1, 2) != 0; }
};

/// None between walls. `grains`: the box around them (wall_triangles.hpp).
std::optional<CellBox> cell_box(const Domain& domain, const Bounds& grains);

/// A line of an outline.
struct CellLine {
  std::array<Vec3, 2> ends;  ///< [m]
  int edge = 0;              ///< 0: of the brick; 1, 2, 3: the edge a, b, c, where the cell leans
};

/// The twelve lines of the brick that grains are wrapped into; behind them, where the cell leans, its edges
/// from the lower corner on, which say where the next bricks stand.
std::vector<CellLine> cell_lines(const CellBox& cell);

}  // namespace talus::io
