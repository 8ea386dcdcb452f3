/// Compiled for AVX-512 F, DQ and VL (kernels/CMakeLists.txt): includes nothing with inline functions of
/// external linkage.

#include "kernels/sweeps/detail/error_lanes.hpp"

namespace talus {

constinit const LaneKernels lane_kernels_avx512[2] = {kernels_of_lanes<true, 8, OneFriction>,
                                                      kernels_of_lanes<true, 8, OwnFriction>};

}  // namespace talus
