#pragma once

#include <cmath>

namespace talus {

/// Coordinates [m] and velocities [m/s] of grains, coordinates and lengths of surfaces [m], and coefficients
/// of friction are refused beyond it: squares, and numbers of cells of the detection, would leave their
/// types.
inline constexpr double farthest = 1e15;

/// False for NaN.
inline bool within_farthest(double number) {
  return std::abs(number) <= farthest;
}

}  // namespace talus
