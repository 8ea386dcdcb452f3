#pragma once

/// How many contacts hold a grain.

#include <cstdint>

#include "runtime/graph/communicator.hpp"
#include "runtime/step/state.hpp"

namespace talus {

/// Coordination number: (2 x active contacts between grains + those with walls) / grains, without rattlers
/// and their contacts. Rattlers are grains with fewer than `hold` active contacts that are not with rattlers.
/// Points of contact count, of which clumps may have several. 0 where all are rattlers. Collective.
double coordination(const StepState& state, const graph::Communicator& ranks, std::int32_t hold);

}  // namespace talus
