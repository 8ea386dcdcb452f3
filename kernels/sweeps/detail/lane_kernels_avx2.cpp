/// Compiled for AVX2 (kernels/CMakeLists.txt): includes nothing with inline functions of external linkage.

#include "kernels/sweeps/detail/error_lanes.hpp"

namespace talus {

constinit const LaneKernels lane_kernels_avx2[3] = {kernels_of_lanes<false, 4, OneFriction>,
                                                    kernels_of_lanes<true, 4, OneFriction>,
                                                    kernels_of_lanes<true, 4, OwnFriction>};

}  // namespace talus
