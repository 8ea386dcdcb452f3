#pragma once

#include <toml++/toml.h>
#include <string>
#include <vector>

namespace talus::io::detail {

/// Parses TOML and applies overrides "a.b=c" in order (load_scene in io/scene/scene.hpp says how paths are
/// read). Every node knows where it stands: source().path is `file`, or "--set a.b=c" for what an override
/// brought in. Stages without a name are named stage-1, stage-2, ... by their number. Throws SceneError.
toml::table parse_document(const std::string& text, const std::string& file,
                           const std::vector<std::string>& overrides);

/// Throws SceneError with the place of `at`, a node of a parsed document.
[[noreturn]] void fail_at(const toml::node& at, const std::string& key, const std::string& message);

/// `text` as a quoted TOML string.
std::string quoted(const std::string& text);

}  // namespace talus::io::detail
