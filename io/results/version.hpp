#pragma once

#include <string>

namespace talus::io {

/// Release of Talus, as `talus --version` prints it.
std::string version();

}  // namespace talus::io
