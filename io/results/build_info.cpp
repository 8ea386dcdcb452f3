#include "io/results/build_info.hpp"

#include "io/build_info_values.hpp"

namespace talus::io {

BuildInfo build_info() {
  return {TALUS_GIT_HASH, TALUS_GIT_DIRTY != 0, TALUS_COMPILER, TALUS_FLAGS, TALUS_BUILD_TYPE};
}

}  // namespace talus::io
