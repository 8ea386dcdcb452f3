/// Time of simulated ranks.

#include "runtime/graph/clock.hpp"

#ifdef TALUS_SMPI

#include <mpi.h>

#include <algorithm>
#include <ctime>

#include "runtime/graph/detail/mpi_call.hpp"

namespace talus::graph {

Clock::time_point Clock::now() noexcept {
  const detail::MpiCall call;
  return time_point(std::chrono::duration_cast<duration>(std::chrono::duration<double>(MPI_Wtime())));
}

namespace detail {
namespace {

/// Of the host. [s]
struct HostTime {
  double clock = 0;      ///< as time passes: what other programs took is in it
  double processor = 0;  ///< of this thread: reading it is in it
};

HostTime host_time() {
  timespec processor{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &processor);
  return {std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(),
          static_cast<double>(processor.tv_sec) + 1e-9 * static_cast<double>(processor.tv_nsec)};
}

/// SMPI gives every rank a copy of the program's data.
struct RankTime {
  HostTime left = host_time();  ///< MPI
  int inside = 0;
};

RankTime& rank_time() {
  static RankTime time;
  return time;
}

}  // namespace

MpiCall::MpiCall() {
  RankTime& time = rank_time();
  if (time.inside++ > 0) return;
  // The clock is read first here and last behind the call: nothing but work lies between.
  const double clock =
      std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count() -
      time.left.clock;
  smpi_execute_flops_benched(host_flops * std::min(clock, host_time().processor - time.left.processor));
}

MpiCall::~MpiCall() {
  RankTime& time = rank_time();
  if (--time.inside == 0) time.left = host_time();
}

void MpiCall::begin_rank() {
  rank_time() = {};
}

}  // namespace detail
}  // namespace talus::graph

#endif
