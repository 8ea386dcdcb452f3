#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "io/scene/detail/scene_key.hpp"
#include "io/scene/scene.hpp"

namespace talus::io::detail {

/// `time_step` of the stage that `stage_of` finds in a Part: a number, or "auto".
template <class Part, class StageOf>
Key<Part> time_step_key(const char* meaning, StageOf stage_of) {
  static constexpr double chosen = -1;
  return bound<double, Part>(
             "time_step", "s", positive, meaning,
             [stage_of](Part& part, double h) {
               Stage& stage = stage_of(part);
               stage.chooses_time_step = h == chosen;
               stage.time_step = h == chosen ? 0 : h;
             },
             [stage_of](const Part& part) -> Value {
               const Stage& stage = stage_of(part);
               return stage.chooses_time_step ? chosen : stage.time_step;
             })
      .or_auto(chosen, "");
}

/// Keys of the walls around the sample, and of the stages that load it through them.
Section<Wall> wall_keys();
Section<Stage> stage_keys();
Section<StageEnd> stage_end_keys();
Section<StageLoad> stage_load_keys();

/// The six sides of a box, in the order of its walls: x-, x+, y-, y+, z-, z+.
const std::vector<std::string>& sides();

/// The wall at sides()[side], which faces the grains. Its coordinate is not a number until place_walls.
Wall wall_at_side(std::size_t side);

/// The axis (0, 1, 2) that the wall is perpendicular to, or -1 for an oblique wall.
int axis_of(const Wall& wall);

}  // namespace talus::io::detail
