#pragma once

#include <vector>

#include "io/scene/scene.hpp"
#include "kernels/detection/domain.hpp"
#include "kernels/samples/sample.hpp"
#include "runtime/step/frame.hpp"
#include "runtime/step/given_forces.hpp"

namespace talus {

/// Where an earlier run was ([sample] kind = "state"), and what the first step may begin from.
struct StateSample {
  Sample sample;                   ///< velocities against the flow of a periodic cell: a run begins with its
                                   ///< cell at rest
  Domain domain;                   ///< of that run
  std::vector<WallReport> walls;   ///< of that run
  std::vector<GivenForce> forces;  ///< walls by their numbers in the new scene; of others left out
  bool clumps = false;             ///< of that run
};

/// Reads the checkpoint or the frame that the scene names. Throws io::SceneError for clumps, where bodies are
/// of materials that the scene has not, and where the scene's periodic cell is not that of the state;
/// io::FileError for a file that cannot be read.
StateSample read_state(const io::Scene& scene);

/// Puts walls of the scene that nothing has placed yet where those of the same name were, with their
/// velocities. Before io::place_walls.
void place_walls_of(const std::vector<WallReport>& walls, io::Scene& scene);

/// A sentence for each surface of the scene that had moved or turned in that run: it begins where the scene
/// puts it, and grains that stood on it may overlap it there.
std::vector<std::string> warnings_of_surfaces(const std::vector<WallReport>& walls, const io::Scene& scene);

}  // namespace talus
