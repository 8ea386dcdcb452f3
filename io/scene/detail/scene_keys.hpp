#pragma once

#include <string>
#include <utility>
#include <vector>

#include "io/scene/detail/scene_key.hpp"
#include "io/scene/scene.hpp"

namespace talus::io::detail {

/// A load as a stage names it: wall and what moves it.
using NamedLoad = std::pair<std::string, WallLoad>;

/// A table of the scene, or the elements of an array of tables.
template <class Part>
struct Section {
  std::string header;   ///< as TOML writes it: "[solver]", "[[stage]]"; "" for the keys at the top
  std::string meaning;  ///< for the reference
  std::vector<Key<Part>> keys;
};

/// The table of keys: the one place where a key is named, bound, limited and explained.
struct SceneKeys {
  Section<Scene> top, material;
  Section<SampleSpec> sample;
  Section<Wall> wall;
  Section<Stage> stage;
  Section<StageEnd> stage_end;
  Section<NamedLoad> stage_load;
  Section<DetectionSettings> detection;
  Section<SolverSettings> solver;
  Section<DecompositionSettings> decomposition;
  Section<OutputSpec> output;
};

/// Calls f(section) for every section, in the order of the reference.
template <class Keys, class F>
void for_each_section(Keys&& keys, F&& f) {
  f(keys.top), f(keys.material), f(keys.sample), f(keys.wall), f(keys.stage), f(keys.stage_end),
      f(keys.stage_load);
  f(keys.detection), f(keys.solver), f(keys.decomposition), f(keys.output);
}

const SceneKeys& scene_keys();

/// The six sides of a box, in the order of its walls: x-, x+, y-, y+, z-, z+.
const std::vector<std::string>& sides();

/// The axis (0, 1, 2) that the wall is perpendicular to, or -1 for an oblique wall.
int axis_of(const Wall& wall);

}  // namespace talus::io::detail
