#pragma once

#include <string>
#include <vector>

#include "apps/validate/validation_case.hpp"

namespace talus {

/// `talus validate`: what Talus gives beside closed forms and the literature.
struct ValidateOptions {
  std::vector<std::string> only;  ///< names of cases; empty: all
  literature::Effort effort;
  std::string out;     ///< directory of validation.csv and report.html; empty: out/validate
  bool force = false;  ///< replace earlier results in it
  bool list = false;   ///< print the cases, run nothing
};

/// Prints each case as it ends, then writes both files. Returns the exit code: 0 when every number is within
/// its band, 1 otherwise, 2 when no case has such a name or the directory is refused.
int validate_command(const ValidateOptions& options);

}  // namespace talus
