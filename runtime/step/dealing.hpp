#pragma once

/// How a sample is distributed over the ranks before the first step.

#include <cstdint>

#include "kernels/bodies/bodies.hpp"
#include "kernels/samples/sample.hpp"
#include "runtime/graph/communicator.hpp"
#include "runtime/step/decomposition.hpp"
#include "runtime/step/setup.hpp"

namespace talus {

/// Collective. Returns the bodies of this rank: those whose centres lie in its subdomains, cut as the
/// settings say. Rank 0 passes the whole sample, all others an empty one. It is sent in pieces of a few
/// thousand grains and freed, so that no other rank ever holds more than its own bodies. Throws
/// std::invalid_argument when there are more ranks than subdomains, or a centre is not finite.
Bodies deal_out(Sample sample, const DecompositionSettings& settings, const graph::Communicator& ranks);

/// Sizes of the whole sample, over the bodies of all ranks.
struct SampleSize {
  std::int64_t bodies = 0;
  double smallest = 0;       ///< radius of a sphere, or of a ball of a clump [m]
  double mean_diameter = 0;  ///< [m]
  double total_mass = 0;     ///< [kg]
  double volume = 0;         ///< of the solid [m^3]
  bool orientation = false;  ///< bodies have orientations
  bool materials = false;    ///< bodies have materials
};

/// Collective; the same bits however the bodies are dealt to the ranks, and in whatever order they stand.
/// `dealt`: the decomposition where ranks have copies of bodies; null: each body stands once.
SampleSize measure_sample(const Bodies& own, const graph::Communicator& ranks,
                          std::span<const Clump> clumps = {}, const Decomposition* dealt = nullptr);

}  // namespace talus
