#pragma once

#include <string>

namespace talus {

struct StatusOptions {
  std::string directory;  ///< of a run
  bool json = false;      ///< one object, for scripts
};

/// `talus status`: how far a run is, read from its files; prints to stdout. Returns an ExitCode.
int status_command(const StatusOptions& options);

}  // namespace talus
