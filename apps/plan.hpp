#pragma once

#include <string>
#include <vector>

namespace talus {

struct PlanOptions {
  std::string scene;
  int threads = 0;  ///< 0: one per core this process may use
  std::vector<std::string> overrides;
};

/// `talus plan`: builds the sample, finds its contacts, and prints what the scene needs, what was left out,
/// and bytes and tasks. Nothing is written. Returns an ExitCode.
int plan_command(const PlanOptions& options);

}  // namespace talus
