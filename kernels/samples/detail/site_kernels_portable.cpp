/// Compiled for every processor; gives the same bits as the other version.

#include "kernels/samples/detail/site_lanes.hpp"

namespace talus {

constinit const SieveSites site_kernels_portable = sieve_sites<4>;

}  // namespace talus
