#pragma once

/// Several ranks in one process, for tests without mpirun.

#include <functional>

#include "runtime/graph/communicator.hpp"

namespace talus::graph {

/// Calls work(ranks) in `count` threads, one for each rank, and returns when all have ended. What they send
/// one another is copied through memory; a message that was sent can be taken once, in the order of sending,
/// as with MPI. abort() throws std::runtime_error there. Where a rank throws, all others throw as soon as
/// they wait for a message that has not come, and the first error is thrown here. Ranks that wait for a
/// message that nobody sends hang, as with MPI.
void on_pretend_ranks(int count, const std::function<void(const Communicator&)>& work);

}  // namespace talus::graph
