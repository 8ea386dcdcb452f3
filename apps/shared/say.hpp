#pragma once

#include <fmt/format.h>

#include <cstdio>
#include <string>

namespace talus {

/// Progress of a study: a line on stderr.
inline void say(const std::string& line) {
  fmt::print(stderr, "talus: {}\n", line);
}

}  // namespace talus
