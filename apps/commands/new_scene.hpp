#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace talus {

/// A scene to start from.
struct SceneKind {
  std::string_view name, sentence;
  std::string_view text;  ///< TOML with comments, but for its `name`
};
const std::vector<SceneKind>& scene_kinds();

struct NewOptions {
  std::string name;  ///< of the scene; NAME.toml is written
  std::string kind;  ///< of scene_kinds()
  bool force = false;
};

/// Writes NAME.toml; a file that is there is replaced only with `force`. Returns an ExitCode.
int new_command(const NewOptions& options);

}  // namespace talus
