#pragma once

#include <cstddef>

#include "kernels/sweeps/momentum.hpp"
#include "runtime/step/state.hpp"

namespace talus {

/// Brings bodies, contacts and acceleration history of a subdomain here into the cache of the core that
/// calls.
void fetch_subdomain(const StepState& state, const AccelerationHistory& acceleration, SubdomainPlace own);

}  // namespace talus
