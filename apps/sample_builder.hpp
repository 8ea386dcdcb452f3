#pragma once

#include "io/scene.hpp"
#include "kernels/sample.hpp"

namespace talus {

/// The grains that a scene asks for, at rest unless its file gives velocities; ids 0..n-1, or those of the
/// file. Throws io::SceneError when the file is missing or damaged, std::invalid_argument when grains do not
/// fit their base.
Sample build_sample(const io::Scene& scene);

}  // namespace talus
