#pragma once

namespace talus {

/// Coordinates [m] and velocities [m/s] of grains, and coordinates and lengths of surfaces [m], are refused
/// beyond it: squares, and numbers of cells of the detection, would leave their types.
inline constexpr double farthest = 1e15;

}  // namespace talus
