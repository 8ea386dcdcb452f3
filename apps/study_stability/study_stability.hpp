#pragma once

#include <string>
#include <vector>

#include "apps/study_stability/stability_run.hpp"

namespace talus {

/// `talus study stability`: many small scenes that are hard for a reason, each in a process of its own.
struct StabilityOptions {
  std::vector<std::string> only;  ///< parts of names; empty: all scenes
  stability::RunSettings settings;
  std::string out;     ///< directory of stability.csv and stability.html; empty: out/study-stability
  bool force = false;  ///< replace earlier results in it
  bool list = false;   ///< print the names and what each asks, run nothing
};

/// Prints a row per scene as it ends, then writes both files. Returns the exit code: 0 when every scene comes
/// out as expected, 1 otherwise, 2 when no scene has such a name or the directory is refused.
int stability_command(const StabilityOptions& options);

}  // namespace talus
