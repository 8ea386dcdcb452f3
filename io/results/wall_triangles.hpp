#pragma once

/// Walls as triangles, for pictures and viewers.

#include <span>
#include <vector>

#include "kernels/shapes/walls.hpp"
#include "runtime/graph/communicator.hpp"
#include "runtime/step/frame.hpp"

namespace talus::io {

/// The box around the spheres of a frame [m]; low > high where there is none.
Bounds grain_bounds(const Frame& frame);
/// The same of all ranks. Collective.
Bounds grain_bounds(const Frame& part, const graph::Communicator& ranks);

/// Triangles [m] of each wall as it stands in `now`, the frame's reports in the order of `walls`: none of an
/// absent one. A surface is shown as it is, a plane as far as the box around `grains` and surfaces and the
/// other planes let it reach; planes no further from the grains than these are large count as part of that
/// box.
std::vector<std::vector<Triangle>> wall_triangles(std::span<const Wall> walls,
                                                  std::span<const WallReport> now, const Bounds& grains);

}  // namespace talus::io
