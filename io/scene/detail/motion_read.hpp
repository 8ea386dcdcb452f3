#pragma once

/// Reading what walls do by themselves: their motions, groups, and the stages in which they are there.

#include <toml++/toml.h>
#include <filesystem>
#include <string>
#include <vector>

#include "io/scene/detail/scene_keys.hpp"
#include "io/scene/scene.hpp"

namespace talus::io::detail {

/// The [[group]]s of a scene, into its setup.
void read_groups(const toml::table& root, const std::filesystem::path& folder, Scene& scene);

/// The motions of a wall whose other keys are read from `table`: its own, or those of its group.
void read_motion_of_wall(const toml::table& table, const std::string& path,
                         const std::filesystem::path& folder, const Scene& scene, Wall& wall);

/// What can be told once walls and stages are read: groups without walls, stages that there are not, tables
/// that end before the run does.
void check_motions(const toml::table& root, const Scene& scene);

}  // namespace talus::io::detail
