#pragma once

/// Coarse-grained fields of a simulation (kernels/fields), for frames.

#include <span>
#include <string>
#include <vector>

#include "kernels/fields/coarse_grid.hpp"
#include "runtime/graph/communicator.hpp"
#include "runtime/step/probe_rules.hpp"

namespace talus {

struct StepState;

/// What is wrong with a rule; "" if nothing.
std::string fault_of(const FieldRule& rule);

struct FieldGrid {
  std::string name;
  Grid grid;
  GridSums sums;  ///< on rank 0; empty on others
};

/// The fields of `rules` after a step, with the poses and velocities of its end; forces are impulses over
/// `impulse_time` > 0 [s]. Summed subdomain after subdomain: the same bits on any ranks and threads. Each
/// rank holds one grid at a time. Collective.
std::vector<FieldGrid> coarse_fields(std::span<const FieldRule> rules, const StepState& state,
                                     double impulse_time, const graph::Communicator& ranks);

}  // namespace talus
