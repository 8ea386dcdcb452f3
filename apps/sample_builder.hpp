#pragma once

#include "io/scene.hpp"
#include "kernels/bodies.hpp"

namespace talus {

/// The grains that a scene asks for, at rest unless its file gives velocities; ids 0..n-1, or those of the
/// file. Throws io::SceneError when the file is missing or damaged, std::invalid_argument when grains do not
/// fit their base.
Bodies build_sample(const io::Scene& scene);

}  // namespace talus
