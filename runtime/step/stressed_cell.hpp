#pragma once

/// A periodic cell of which some components of the flow follow a stress: one more body in the contact problem
/// of the step (docs/theory.md, "Cells under stress"; kernels/bodies/cell_velocity.hpp).

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "kernels/bodies/cell_velocity.hpp"
#include "kernels/bodies/index.hpp"
#include "kernels/bodies/types.hpp"
#include "kernels/sweeps/cell_copy.hpp"

namespace talus {

/// Number of a chunk of this rank, as in Chunks.
using ChunkId = Index<struct ChunkTag>;

/// The cell during a stage, and what a step makes of it.
struct StressedCell {
  std::array<bool, cell_freedoms> follows{};  ///< components that follow a stress; none: no such cell
  double length = 0;                          ///< d [m]: its velocity is d G
  double mass = 0;                            ///< [kg]
  std::int64_t grains = 0;                    ///< in it, on all ranks
  std::vector<CellCopy> copies;               ///< per chunk; void where it has no contacts
  std::vector<ChunkId> held;                  ///< chunks here whose copies count, ascending
  std::int64_t copies_everywhere = 0;         ///< on all ranks
  CellVelocity aim{};       ///< stress that it follows in the step, 0 where it does not [Pa]
  CellVelocity push{};      ///< of the stress on the cell in the step, over its impulse time [N s]
  CellVelocity impulse{};   ///< of the contacts, from the last check [N s]
  CellVelocity velocity{};  ///< that the step has found, beyond that without contacts [m/s]

  bool loaded() const {
    for (const bool free : follows)
      if (free) return true;
    return false;
  }
  /// 1 where components of the velocity gradient follow a stress, 0 elsewhere.
  Mat3 followed() const {
    CellVelocity components{};
    std::copy(follows.begin(), follows.end(), components.begin());
    return gradient_of(components, 1);
  }
  /// 1/mass of each component, of a copy that is one of `copies`.
  CellVelocity inv_mass(double of_copies = 1) const {
    CellVelocity inverse{};
    for (std::size_t k = 0; k < cell_freedoms; ++k) inverse[k] = follows[k] ? of_copies / mass : 0;
    return inverse;
  }
};

}  // namespace talus
