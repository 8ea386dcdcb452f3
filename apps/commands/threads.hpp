#pragma once

/// How many threads a run of a scene takes when nobody says how many.

#include <algorithm>
#include <cstdint>

#include "io/scene/scene.hpp"

namespace talus {

/// A thread for fewer grains than these costs more than it does: beside a second one some 1000 of them were
/// swept more slowly than alone, 3000 as fast, 10,000 a quarter faster.
inline constexpr std::int64_t grains_per_thread = 2000;

/// Threads of each of `ranks` ranks, no more than `cores`, for a scene that begins with so many grains. Those
/// to come count as if they came at once; where nobody knows how many, all cores.
inline int threads_for(const io::Scene& scene, std::int64_t grains, int ranks, int cores) {
  for (const InsertRule& rule : scene.setup.inserts) {
    if (!rule.count) return cores;
    grains += *rule.count;
  }
  return static_cast<int>(std::clamp<std::int64_t>(grains / (grains_per_thread * ranks), 1, cores));
}

}  // namespace talus
