#pragma once

#include <stdexcept>
#include <vector>

#include "io/scene/scene.hpp"
#include "runtime/graph/communicator.hpp"

namespace talus {

/// What a part costs: the scene's first step with it and without it.
struct MeasuredSaving {
  const char* part;                          ///< e.g. "friction"
  bool in_scene = false;                     ///< the scene has it
  double with_ns = 0, without_ns = 0;        ///< of a sweep, per contact [ns]; NaN when not measured
  double with_bytes = 0, without_bytes = 0;  ///< held, per contact
};

/// Why nothing can be measured, and what to do.
struct NothingToMeasure : std::invalid_argument {
  using std::invalid_argument::invalid_argument;
};

/// Measures on the scene's own sample what leaving out friction, rotation, pushed walls, subdomains and
/// messages saves. Each is the same number of plain sweeps over the first step with the part and without it,
/// in turns, `repeats` times; the fastest stretch counts. Instead of being pushed, walls then move at a given
/// velocity. Parts that the scene does not have are put in for the comparison: friction of 0.35, walls pushed
/// with the weight of the sample, eight subdomains. What messages cost is measured with MPI sending to
/// itself, so the session must have been started; it is the share of the software, without a network. Throws
/// NothingToMeasure where the first step sweeps nothing, and what Simulation throws.
std::vector<MeasuredSaving> measure_savings(const io::Scene& scene, int threads, int repeats,
                                            const graph::Communicator& ranks);

/// The table of `talus plan --measure`.
void print_savings(const std::vector<MeasuredSaving>& savings, int threads, int repeats);

}  // namespace talus
