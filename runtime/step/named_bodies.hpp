#pragma once

#include <span>
#include <vector>

#include "runtime/graph/communicator.hpp"
#include "runtime/step/frame.hpp"
#include "runtime/step/setup.hpp"
#include "runtime/step/state.hpp"

namespace talus {

/// Follows the bodies that a scene names. Costs nothing where there are none.
class NamedBodies {
 public:
  /// Before a step: notes how these bodies move. Collective.
  void begin_step(std::span<const NamedBody> named, const StepState& state, const graph::Communicator& ranks);
  /// After it: a report of each body that is still there, in the order of the setup. Collective.
  std::vector<BodyReport> end_step(std::span<const NamedBody> named, const StepState& state,
                                   const StepParameters& parameters, const graph::Communicator& ranks) const;

  /// Of a body as a step begins.
  struct Motion {
    Vec3 x, u;  ///< centre [m], velocity [m/s]
  };

 private:
  std::vector<Motion> before_;
};

}  // namespace talus
