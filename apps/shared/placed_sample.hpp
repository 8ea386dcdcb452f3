#pragma once

#include <string>
#include <vector>

#include "io/scene/scene.hpp"
#include "kernels/samples/sample.hpp"
#include "runtime/step/given_forces.hpp"

namespace talus {

/// The grains that a scene begins with, and what it begins with besides.
struct PlacedSample {
  Sample sample;
  std::vector<GivenForce> forces = {};     ///< of a state
  std::vector<std::string> warnings = {};  ///< sentences about a state
};

/// build_sample, and in the scene what depends on it: places of walls, masses that they choose, the ids of
/// named bodies (io::place_walls); of a state the places and velocities that its walls had, and the stress
/// that its contacts bear. Throws as build_sample and read_state do.
PlacedSample place_sample(io::Scene& scene);

}  // namespace talus
