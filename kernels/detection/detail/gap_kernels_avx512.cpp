/// Compiled for AVX-512 (kernels/CMakeLists.txt): includes nothing with inline functions of external linkage.

#include "kernels/detection/detail/gap_lanes.hpp"

namespace talus {

constinit const FindGaps gap_kernels_avx512 = find_gaps<8>;

}  // namespace talus
