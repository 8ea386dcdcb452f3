/// Time of simulated ranks.

#include "runtime/graph/clock.hpp"

#ifdef TALUS_SMPI

#include <mpi.h>

#include <algorithm>
#include <ctime>
#include <utility>

#include "runtime/graph/detail/mpi_call.hpp"

namespace talus::graph {

Clock::time_point Clock::now() noexcept {
  const detail::MpiCall call(true);
  return time_point(std::chrono::duration_cast<duration>(std::chrono::duration<double>(MPI_Wtime())));
}

namespace detail {
namespace {

/// Times of the host [s].
struct HostTime {
  double clock = 0;      ///< wall-clock time, other programs' share included
  double processor = 0;  ///< processor time of this thread, with that of reading it
};

HostTime host_time() {
  timespec processor{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &processor);
  return {std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(),
          static_cast<double>(processor.tv_sec) + 1e-9 * static_cast<double>(processor.tv_nsec)};
}

/// Time of one rank. SMPI gives every rank a copy of the program's static data.
struct RankTime {
  HostTime left = host_time();  ///< when it last left MPI
  int inside = 0;
  double owed = 0;   ///< has passed on the host or was given, not yet on the simulated machine [s]
  double given = 0;  ///< of the innermost GivenTime, not yet in `owed` [s]
  int givers = 0;

  /// Adds the host's time since `left` to `owed`, unless a GivenTime replaces it.
  void look() {
    if (givers > 0) return;
    // The clock is read first here and last behind the call: nothing but work lies between.
    const double clock =
        std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count() -
        left.clock;
    owed += std::min(clock, host_time().processor - left.processor);
  }
};

RankTime& rank_time() {
  static RankTime time;
  return time;
}

}  // namespace

MpiCall::MpiCall(bool takes) {
  RankTime& time = rank_time();
  if (time.inside++ > 0) return;
  time.look();
  if (!takes) time.owed += std::exchange(time.given, 0);
  if (time.owed > 0) smpi_execute_flops_benched(host_flops * std::exchange(time.owed, 0));
}

MpiCall::~MpiCall() {
  RankTime& time = rank_time();
  if (--time.inside == 0) time.left = host_time();
}

void MpiCall::begin_rank() {
  rank_time() = {};
}

}  // namespace detail

GivenTime::GivenTime(double seconds) {
  detail::RankTime& time = detail::rank_time();
  time.look();
  ++time.givers;
  around_ = std::exchange(time.given, seconds);
}

GivenTime::~GivenTime() {
  detail::RankTime& time = detail::rank_time();
  time.owed += std::exchange(time.given, around_);
  if (--time.givers == 0) time.left = detail::host_time();
}

}  // namespace talus::graph

#endif
