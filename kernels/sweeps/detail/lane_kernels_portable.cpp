/// Compiled for every processor. Where it has no fused product, `fused` calls the one of the C library.

#include "kernels/sweeps/detail/error_lanes.hpp"

namespace talus {

constinit const LaneKernels lane_kernels_portable[3] = {kernels_of_lanes<false, 4, OneFriction>,
                                                        kernels_of_lanes<true, 4, OneFriction>,
                                                        kernels_of_lanes<true, 4, OwnFriction>};

}  // namespace talus
