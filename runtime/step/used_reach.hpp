#pragma once

/// Bodies that have come, since the last broad phase, further than candidates were looked for.

#include <optional>

#include "kernels/detection/unseen.hpp"
#include "runtime/graph/communicator.hpp"
#include "runtime/step/cell_flow.hpp"
#include "runtime/step/state.hpp"

namespace talus {

/// Asked at the end of a step. Up to its middle the margins of bodies are watched (skin_escape.hpp), and are
/// wide enough for the speed with which it began; one that the step has struck may use up more.
class UsedReach {
 public:
  /// Keeps a reference.
  explicit UsedReach(const StepState& state);
  /// Whether the body may overlap one that is no candidate of it.
  bool used_up(std::size_t slot) const;

 private:
  const StepState& state_;
  std::optional<FlowMargins> flow_;
};

/// Whether any body of the range has used up its reach.
bool any_beyond_reach(const StepState& state, SlotRange range);

/// An overlap by the ids of its pair.
struct PairOverlap {
  BodyPair pair;
  double depth;           ///< > 0 [m]
  double smaller_radius;  ///< [m]
};

/// All overlaps that bodies which have used up their reach may have with others, and with walls; of all
/// bodies where `walls_beyond`, as walls have come further than candidates were looked for. Each pair on a
/// rank that has one of its bodies, with others that overlap, in no promised order. Collective.
std::vector<PairOverlap> overlaps_with_others(const StepState& state, bool walls_beyond,
                                              const graph::Communicator& ranks);

}  // namespace talus
