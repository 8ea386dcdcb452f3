#pragma once

#include <span>
#include <string>
#include <vector>

#include "io/scene/scene.hpp"
#include "kernels/bodies/cell_velocity.hpp"
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
  std::vector<std::string> materials;  ///< names of that run, by number; empty where it had none
  bool clumps = false;                 ///< of that run
};

/// Reads the checkpoint or the frame that the scene names. Materials are those of the same name.
/// Throws io::SceneError, at the scene's line, for a file that cannot be read, for clumps, where bodies are
/// of materials that the scene has not, and where the scene's periodic cell is not that of the state.
StateSample read_state(const io::Scene& scene);

/// Setup::stress_at_start of a sample with these forces, when its walls are placed: what a periodic cell
/// feels of the forces between its grains; 0 where it is not known how large the cell is.
CellVelocity stress_at_start(const Sample& sample, std::span<const GivenForce> forces, const Setup& setup);

/// Puts walls of the scene that nothing has placed yet where those of the same name were, with their
/// velocities. Before io::place_walls.
void place_walls_of(const std::vector<WallReport>& walls, io::Scene& scene);

/// A sentence for each surface of the scene that had moved or turned in that run: it begins where the scene
/// puts it, and grains that stood on it may overlap it there.
std::vector<std::string> warnings_of_surfaces(const std::vector<WallReport>& walls, const io::Scene& scene);

}  // namespace talus
