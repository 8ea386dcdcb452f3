#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "io/scene/detail/scene_key.hpp"
#include "io/scene/scene.hpp"

namespace talus::io::detail {

/// A load as a stage names it: wall and what moves it.
using NamedLoad = std::pair<std::string, WallLoad>;

/// Keys of the walls around the sample, and of the stages that load it through them.
Section<Wall> wall_keys();
Section<Stage> stage_keys();
Section<StageEnd> stage_end_keys();
Section<NamedLoad> stage_load_keys();

/// The six sides of a box, in the order of its walls: x-, x+, y-, y+, z-, z+.
const std::vector<std::string>& sides();

/// The wall at sides()[side], which faces the grains. Its coordinate is not a number until place_walls.
Wall wall_at_side(std::size_t side);

/// The axis (0, 1, 2) that the wall is perpendicular to, or -1 for an oblique wall.
int axis_of(const Wall& wall);

}  // namespace talus::io::detail
