#include "runtime/graph/clock.hpp"

#ifdef TALUS_SMPI
#include <mpi.h>

namespace talus::graph {

Clock::time_point Clock::now() noexcept {
  return time_point(std::chrono::duration_cast<duration>(std::chrono::duration<double>(MPI_Wtime())));
}

}  // namespace talus::graph
#endif
