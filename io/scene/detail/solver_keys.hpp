#pragma once

#include "io/scene/detail/scene_key.hpp"
#include "io/scene/scene.hpp"

namespace talus::io::detail {

/// Keys of how a step is computed: which pairs of grains are looked at, how their contact forces are solved
/// for, and how the work is shared among ranks. What is simulated does not depend on them.
Section<DetectionSettings> detection_keys();
Section<SolverSettings> solver_keys();
Section<DecompositionSettings> decomposition_keys();

}  // namespace talus::io::detail
