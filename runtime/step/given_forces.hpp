#pragma once

/// Forces that a sample brings along from an earlier run: the warm start of the first step.

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "kernels/bodies/types.hpp"
#include "kernels/detection/chunks.hpp"
#include "runtime/graph/communicator.hpp"

namespace talus {

/// A force between two bodies, named by their ids; for wall w the second id is -1 - w.
struct GivenForce {
  std::int64_t first = 0, second = 0;
  std::int64_t feature = 0;      ///< WallPair
  double force[3] = {0, 0, 0};   ///< on the first body [N]
  double normal[3] = {0, 0, 0};  ///< unit, from the second body to the first
};

/// The given forces between bodies of this rank, as candidates of an earlier step: sorted, with the impulses
/// that these forces give over `impulse_time` [s]. `slot_of(id)`: -1 for a body that is not here; `bodies`:
/// number of slots. Each rank passes the forces it has. They travel in pieces, so that no rank holds more
/// than a few thousand of another. Collective.
Candidates given_candidates(std::span<const GivenForce> own, const graph::Communicator& ranks,
                            ImpulseKind kind, double impulse_time, std::size_t bodies,
                            const std::function<Slot(std::int64_t)>& slot_of);

}  // namespace talus
