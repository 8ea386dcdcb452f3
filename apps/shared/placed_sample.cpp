#include "apps/shared/placed_sample.hpp"

#include <utility>

#include "apps/shared/sample_builder.hpp"
#include "apps/shared/state_sample.hpp"

namespace talus {

PlacedSample place_sample(io::Scene& scene) {
  PlacedSample placed;
  if (scene.from_state()) {
    StateSample state = read_state(scene);
    placed.sample = build_sample(scene, std::move(state.sample));
    placed.forces = std::move(state.forces);
    place_walls_of(state.walls, scene);
    placed.warnings = warnings_of_surfaces(state.walls, scene);
  } else {
    placed.sample = build_sample(scene);
  }
  io::place_walls(scene, placed.sample);
  scene.setup.stress_at_start = stress_at_start(placed.sample, placed.forces, scene.setup);
  return placed;
}

}  // namespace talus
