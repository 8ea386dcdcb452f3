#include "runtime/graph/communicator.hpp"

#include <thread>

#include "runtime/graph/clock.hpp"
#include "runtime/graph/worker.hpp"

namespace talus::graph {

void demand_thread_level(const std::string& level, int ranks, int threads) {
  if (ranks == 1 || threads == 1 || level == "serialized" || level == "multiple") return;
  throw std::invalid_argument("MPI lets one thread of a rank call it (MPI_Query_thread: " + level +
                              "), and " + std::to_string(threads) +
                              " threads would: use --threads 1 and more ranks, or an MPI built for threads");
}

double Channel::wait() {
  const double start = seconds_now();
  for (int polls = 0; !done(); ++polls)
    if (polls < 256)
      pause();
    else
      std::this_thread::yield();
  return seconds_now() - start;
}

bool Communicator::meet(double seconds) const {
  if (ranks() == 1) return true;
  const double end = seconds_now() + seconds;
  const std::unique_ptr<Meeting> meeting = start_meeting();
  bool met = meeting->complete();
  for (; !met && seconds_now() < end; met = meeting->complete()) std::this_thread::yield();
  return met;
}

}  // namespace talus::graph
