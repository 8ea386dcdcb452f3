#pragma once

#include "io/scene/detail/scene_key.hpp"
#include "io/scene/scene.hpp"

namespace talus::io::detail {

Section<CellSpec> cell_keys();
/// Of a stage: the stress that components of the cell follow.
Section<StressLoad> stress_keys();

}  // namespace talus::io::detail
