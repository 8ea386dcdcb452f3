#pragma once

/// Room for grains to be inserted: random places in a region where they overlap no body.

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/graph/communicator.hpp"
#include "runtime/step/grain_rules.hpp"
#include "runtime/step/state.hpp"

namespace talus {

/// A grain in search of a place, and one that has found it.
struct Seeker {
  std::uint64_t number = 0;  ///< of the grain within its rule
  double radius = 0;         ///< [m]
};
struct FoundPlace {
  std::size_t seeker = 0;
  Vec3 x = Vec3::Zero();  ///< [m]
};
struct FoundPlaces {
  std::vector<FoundPlace> places;  ///< in order of the attempts, at most one for a seeker
  std::int64_t rounds = 0;         ///< attempts that were made
};

/// What the places depend on, besides the bodies that are there.
struct PlaceDraw {
  std::uint64_t seed = 1;
  std::uint32_t stream = 0;  ///< of the rule
  std::int64_t round = 0;    ///< attempts that the rule has made before
  int attempts = 1;          ///< for each seeker, at most
};

/// Spheres that are in the way [m].
struct Spheres {
  std::vector<Vec3> x;
  std::vector<double> radius;
};

/// Collective, and the same on all ranks, however bodies are dealt to them. Each seeker tries one place after
/// the other; of two that want the same room in the same attempt the one that stands first gets it. `taken`:
/// grains that were already inserted, known to all ranks.
FoundPlaces find_places(const Region& region, std::span<const Seeker> seekers, const PlaceDraw& draw,
                        const StepState& state, const Spheres& taken, const graph::Communicator& ranks);

}  // namespace talus
