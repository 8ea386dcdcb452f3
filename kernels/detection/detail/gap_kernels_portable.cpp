/// Compiled for every processor: what the others do, to the bit.

#include "kernels/detection/detail/gap_lanes.hpp"

namespace talus {

constinit const FindGaps gap_kernels_portable = find_gaps<4>;

}  // namespace talus
