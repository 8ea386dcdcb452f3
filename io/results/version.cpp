#include "io/results/version.hpp"

namespace talus::io {

std::string version() {
  return "0.1.0";
}

}  // namespace talus::io
