#pragma once

#include <string_view>

namespace talus::io {

/// What was built, from which sources, and how.
struct BuildInfo {
  std::string_view git_hash;  ///< "unknown" outside a git checkout
  bool git_dirty = false;
  std::string_view compiler;
  std::string_view flags;
  std::string_view build_type;
};

BuildInfo build_info();

}  // namespace talus::io
