/// Compiled for AVX2 (kernels/CMakeLists.txt): includes nothing with inline functions of external linkage.

#include "kernels/detection/detail/gap_lanes.hpp"

namespace talus {

constinit const FindGaps gap_kernels_avx2 = find_gaps<4>;

}  // namespace talus
