#pragma once

/// Adds bodies to a rank, or removes them, between steps. All data kept per slot are updated, except those
/// that a step computes anew: free velocities, which the caller resizes, and the places at the last broad
/// phase.

#include <cstdint>
#include <span>
#include <vector>

#include "kernels/samples/sample.hpp"
#include "runtime/graph/communicator.hpp"
#include "runtime/step/setup.hpp"
#include "runtime/step/state.hpp"

namespace talus {

/// A sphere to be added to the bodies; all ranks pass the same.
struct NewGrain {
  Grain grain;
  Material material = material_of_grains;
  std::array<double, 6> velocity{};  ///< u and R omega [m/s]
};

/// Removes every copy of the bodies with these ids (ascending), and their candidates. The candidates that
/// remain keep their impulses; the next step finds candidates anew.
void drop_bodies(std::span<const std::int64_t> ids, StepState& state);

/// Appends those of the grains that lie in subdomains of this rank, each to the slots of its subdomain. The
/// next step finds candidates anew.
void add_bodies(std::span<const NewGrain> grains, const Setup& setup, const graph::Communicator& ranks,
                StepState& state);

/// Puts the bodies of one subdomain in Morton order, and their candidates with them.
void sort_bodies(StepState& state);

}  // namespace talus
