#pragma once

#include <string>

#include "apps/shared/print.hpp"

namespace talus {

/// Progress of a study: a line on stderr.
inline void say(const std::string& line) {
  print_error("talus: {}\n", line);
}

}  // namespace talus
