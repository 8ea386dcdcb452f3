#pragma once

/// Bodies of a rank that come and go between steps. All that is kept per slot follows, but for what a step
/// makes anew: free velocities, which the caller resizes, and where bodies stood at the last broad phase.

#include <cstdint>
#include <span>
#include <vector>

#include "kernels/samples/sample.hpp"
#include "runtime/graph/communicator.hpp"
#include "runtime/step/setup.hpp"
#include "runtime/step/state.hpp"

namespace talus {

/// A sphere on its way into the bodies, the same on all ranks.
struct NewGrain {
  Grain grain;
  Material material = material_of_grains;
  std::array<double, 6> velocity{};  ///< u and R omega [m/s]
};

/// Drops every copy of the bodies with these ids (ascending), and their candidates. The candidates of the
/// others keep their impulses, and are to be found anew.
void drop_bodies(std::span<const std::int64_t> ids, StepState& state);

/// Appends those of the grains that lie in subdomains of this rank, each to the slots of its subdomain. The
/// candidates are to be found anew.
void add_bodies(std::span<const NewGrain> grains, const Setup& setup, const graph::Communicator& ranks,
                StepState& state);

/// Puts the bodies of one subdomain in Morton order, and their candidates with them.
void sort_bodies(StepState& state);

}  // namespace talus
