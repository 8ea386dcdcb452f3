#pragma once

#include <toml++/toml.h>

#include <filesystem>
#include <initializer_list>
#include <optional>
#include <string>

#include "io/scene/scene.hpp"

namespace talus::io::detail {

/// Reads [sample] or every [[sample]] into the scene, and what the setup knows of them: clumps, and bodies
/// with names. Relative paths begin at `folder`. Throws SceneError.
void read_samples(const toml::table& root, const std::filesystem::path& folder, Scene& scene);

/// The region of a table; none where it gives none. Throws SceneError when its shape is none of `shapes`.
std::optional<Region> read_region(const toml::table& table, const std::string& path,
                                  std::initializer_list<Region::Kind> shapes);

/// Of a distribution that is read: fails at the key that `table` gives it by.
void check_radii(const toml::table& table, const std::string& path, SizeDistribution& radii);

}  // namespace talus::io::detail
