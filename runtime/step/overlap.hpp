#pragma once

/// Overlaps as part of what a step certifies (docs/theory.md, "Overlap"). At the end of a step no pair may
/// overlap by more than a part of the smaller radius, beyond its overlap when the run began. Overlaps that a
/// sample begins with are allowed; as far as they open during the run, they are not allowed again.

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

/// Of the overlaps that a sample begins with.
struct OverlapThresholds {
  /// Part of the tolerance below which one is not remembered, in [0, 1): it hides nothing that matters, and
  /// each that is remembered is looked up in every step until it has opened.
  double negligible = 0.1;
};

/// The pair with the deepest overlap at the end of a step.
struct DeepestOverlap {
  double depth = 0;    ///< over the smaller radius, beyond what the pair was given
  bool named = false;  ///< `pair` is known: `depth` is beyond the tolerance
  BodyPair pair;
};

/// Overlaps of more than `negligible` x `tolerance` x smaller radius before the first step, in order of their
/// pairs, the same on all ranks. To be called between the narrow phase of the first step and its iterations:
/// bodies and walls are then in mid-step, and are followed back to its beginning by their velocities, without
/// the spin of clumps. Collective.
std::vector<GivenOverlap> given_overlaps(const StepState& state, const StepParameters& parameters,
                                         double tolerance, const graph::Communicator& ranks,
                                         const OverlapThresholds& thresholds = {});

/// What the sums of a step tell of its overlaps.
struct OverlapSums {
  double deepest = 0;  ///< among its candidates, over the smaller radius, on all ranks (ContactSums)
  bool bodies_beyond = false, walls_beyond = false;  ///< these may overlap what is no candidate (StepSums)
};

/// The deepest overlap with which the step has ended, between any two bodies or a body and a wall. Pairs are
/// looked at one by one only if `sums` exceed `tolerance`, or overlaps were given, or bodies have left their
/// reach. What has opened of the given overlaps is taken from state.given_overlaps. Collective.
DeepestOverlap find_deepest_overlap(StepState& state, const OverlapSums& sums, double tolerance,
                                    const graph::Communicator& ranks);

}  // namespace talus
