/// Compiled for AVX2 (kernels/CMakeLists.txt): includes nothing with inline functions of external linkage.

#include "kernels/samples/detail/site_lanes.hpp"

namespace talus {

constinit const SieveSites site_kernels_avx2 = sieve_sites<4>;

}  // namespace talus
