/// Compiled for every processor; gives the same bits as the other versions.

#include "kernels/detection/detail/gap_lanes.hpp"

namespace talus {

constinit const FindGaps gap_kernels_portable = find_gaps<4>;

}  // namespace talus
