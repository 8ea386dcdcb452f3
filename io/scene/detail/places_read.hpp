#pragma once

#include <string>

#include "io/scene/detail/toml_document.hpp"
#include "io/scene/scene_places.hpp"

namespace talus::io::detail {

/// Where the tables and keys of a parsed document stand in `file`.
ScenePlaces places_of(const toml::table& root, const std::string& file);

}  // namespace talus::io::detail
