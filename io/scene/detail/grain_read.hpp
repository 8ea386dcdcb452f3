#pragma once

#include <toml++/toml.h>

#include "io/scene/scene.hpp"

namespace talus::io::detail {

/// Reads every [[insert]] and [[remove]] into the setup of a scene whose materials and stages are read.
/// Throws SceneError.
void read_grain_rules(const toml::table& root, Scene& scene);

}  // namespace talus::io::detail
