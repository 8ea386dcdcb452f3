/// Time of simulated ranks.

#include "runtime/graph/clock.hpp"

#ifdef TALUS_SMPI

#include <mpi.h>

#include "runtime/graph/detail/mpi_call.hpp"

namespace talus::graph {

Clock::time_point Clock::now() noexcept {
  const detail::MpiCall call;
  return time_point(std::chrono::duration_cast<duration>(std::chrono::duration<double>(MPI_Wtime())));
}

namespace detail {
namespace {

using HostClock = std::chrono::steady_clock;

/// SMPI gives every rank a copy of the program's data.
struct RankTime {
  HostClock::time_point left = HostClock::now();  ///< MPI
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
  smpi_execute_flops_benched(host_flops *
                             std::chrono::duration<double>(HostClock::now() - time.left).count());
}

MpiCall::~MpiCall() {
  RankTime& time = rank_time();
  if (--time.inside == 0) time.left = HostClock::now();
}

void MpiCall::begin_rank() {
  rank_time() = {};
}

}  // namespace detail
}  // namespace talus::graph

#endif
