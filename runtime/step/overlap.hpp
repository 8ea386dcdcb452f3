#pragma once

/// Overlaps as part of what a step certifies (docs/theory.md, "Overlap"). A step answers for the positions
/// that it ends with: no pair may be in by more than a part of the smaller radius, beyond what it had when
/// the run began. Overlaps that a sample is given are no fault of any step; what opens of them is not given
/// again.

#include <compare>
#include <cstdint>
#include <vector>

#include "runtime/graph/communicator.hpp"

namespace talus {

struct StepParameters;
struct StepState;

/// Two bodies by their ids, the smaller first; or a body and wall w, as -1 - w.
struct BodyPair {
  std::int64_t body = -1;
  std::int64_t with = -1;
  auto operator<=>(const BodyPair&) const = default;
  static BodyPair of_bodies(std::int64_t a, std::int64_t b) {
    return a < b ? BodyPair{a, b} : BodyPair{b, a};
  }
  static BodyPair at_wall(std::int64_t body, std::int32_t wall) { return {body, -1 - wall}; }
};

/// Depth by which a pair overlapped before the first step [m], as far as it has not opened since.
struct GivenOverlap {
  BodyPair pair;
  double depth = 0;
};

/// The pair that is in deepest at the end of a step.
struct DeepestOverlap {
  double depth = 0;    ///< over the smaller radius, beyond what the pair was given
  bool named = false;  ///< `pair` is known: `depth` is beyond the tolerance
  BodyPair pair;
};

/// Overlaps of more than a tenth of `tolerance` x smaller radius before the first step, in order of their
/// pairs, the same on all ranks. To be called between the narrow phase of the first step and its iterations:
/// contacts and velocities are used with bodies and walls in mid-step, from where these are followed back;
/// the spin of clumps in that half step is neglected. Collective.
std::vector<GivenOverlap> given_overlaps(const StepState& state, const StepParameters& parameters,
                                         double tolerance, const graph::Communicator& ranks);

/// Looks at the contacts of the step that has ended. `deepest`: of all ranks, over the smaller radius
/// (ContactSums); while that is within `tolerance` and nothing was given, no contact is looked at. What was
/// given and has opened is taken from state.given_overlaps. Collective.
DeepestOverlap find_deepest_overlap(StepState& state, double deepest, double tolerance,
                                    const graph::Communicator& ranks);

}  // namespace talus
