/// Compiled for AVX2 (kernels/CMakeLists.txt): includes nothing with inline functions of external linkage.

#include "kernels/detail/error_lanes.hpp"

namespace talus {

LaneKernelPair lane_kernels_avx2() {
  return {kernels_of_lanes<true, 4>, kernels_of_lanes<false, 4>};
}

}  // namespace talus
