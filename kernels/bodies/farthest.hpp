#pragma once

namespace talus {

/// No coordinate [m], length [m] or speed [m/s] of a scene is larger: beyond it a double tells no two grains
/// apart, and squares and numbers of cells leave their types.
inline constexpr double farthest = 1e15;

}  // namespace talus
