/// Compiled for AVX-512 F, DQ and VL (kernels/CMakeLists.txt): includes nothing with inline functions of
/// external linkage.

#include "kernels/detail/error_lanes.hpp"

namespace talus {

LaneKernelPair lane_kernels_avx512() {
  // Half records in lanes of 4 are swept faster than in lanes of 8: 3.5 against 4.2 ns per contact. V afresh
  // takes few registers: 3.0 against 4.1 ns.
  const LaneKernelPair avx2 = lane_kernels_avx2();
  LaneKernels friction = kernels_of_lanes<true, 8>;
  friction.accumulate_grains = avx2.friction.accumulate_grains;
  friction.accumulate_wall = avx2.friction.accumulate_wall;
  return {friction, avx2.frictionless};
}

}  // namespace talus
