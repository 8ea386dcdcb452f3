#pragma once

#include <string>
#include <vector>

#include "runtime/graph/communicator.hpp"

namespace talus {

struct PlanOptions {
  std::string scene;
  int threads = 0;       ///< 0: as threads_for says
  bool measure = false;  ///< also what each omission saves, by a benchmark of some seconds
  std::vector<std::string> overrides;
};

/// `talus plan`: builds the sample, finds its contacts, and prints what the scene needs, what was left out,
/// and bytes and tasks. Nothing is written. Returns an ExitCode.
int plan_command(const PlanOptions& options, const graph::Communicator& ranks);

}  // namespace talus
