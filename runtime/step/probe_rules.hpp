#pragma once

/// Rules of a scene for probes and fields; probes.hpp and field_grids.hpp measure them.

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "kernels/bodies/types.hpp"
#include "kernels/shapes/region.hpp"

namespace talus {

/// A region of space to measure. For a box, a cylinder or all beyond a plane: what is in it; for a disc or a
/// plane: what goes through it.
struct ProbeRule {
  std::string name;
  Region region;
  std::optional<double> every;              ///< [s] from report to report
  std::optional<std::int64_t> every_steps;  ///< steps likewise; whichever comes first
};

/// Coarse-grained fields on a grid of cells, computed with every frame after a step.
struct FieldRule {
  std::string name;
  Vec3 low = Vec3::Zero(), high = Vec3::Zero();  ///< [m] corners of the grid
  std::array<std::int64_t, 3> cells{};           ///< along x, y, z
  double width = 0;                              ///< [m] of the function that a grain is spread by (lucy.hpp)
};

}  // namespace talus
