#pragma once

#include <toml++/toml.h>

#include "io/scene/scene.hpp"

namespace talus::io::detail {

/// Reads every [[probe]] and [[field]] into the setup of a scene whose output is read. Throws SceneError.
void read_probes(const toml::table& root, Scene& scene);

/// "" or which wall a probe lies behind as a whole: a plane that stands all the time and does not move.
std::string probe_fault(const ProbeRule& probe, const std::vector<Wall>& walls);

}  // namespace talus::io::detail
