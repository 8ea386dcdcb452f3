#pragma once

/// Passages of bodies through the discs and planes of the probes, step by step.

#include <cstdint>
#include <span>
#include <vector>

#include "kernels/bodies/types.hpp"
#include "runtime/graph/communicator.hpp"
#include "runtime/step/probe_rules.hpp"
#include "runtime/step/state.hpp"

namespace talus {

/// A body that went through a probe within a step.
struct Passage {
  std::int64_t probe, id, material;
  std::int64_t way;  ///< 1 along the normal, -1 against it
  double mass;       ///< [kg]
};

/// Compares the places of bodies before and after a step and takes the path between for straight. Keeps
/// nothing from step to step: bodies that come, go or are read from a checkpoint between two steps have not
/// moved.
class Passages {
 public:
  /// Before a step, when grains have come and gone.
  void begin_step(const StepState& state);
  /// After it: passages through `probes` in order of probe and id, the same on all ranks. `dealt`: bodies may
  /// stand in other slots, and on other ranks, than before; they are then known by their ids. Collective.
  std::vector<Passage> end_step(std::span<const ProbeRule> probes, const StepState& state, bool dealt,
                                const graph::Communicator& ranks);

 private:
  /// Where a body was.
  struct Place {
    std::int64_t id;
    double x[3];  ///< [m]
  };
  std::vector<Place> places_of(const StepState& state, const graph::Communicator& ranks);

  std::vector<Place> before_;  ///< of the bodies that count here, in order of their slots
};

}  // namespace talus
