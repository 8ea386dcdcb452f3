#pragma once

/// The ranks that mpirun, srun or smpirun has started.

#include "runtime/graph/communicator.hpp"

namespace talus::graph {

/// Starts MPI for the life of the object when the process was started by mpirun or srun (or `always`), and
/// ends it. Create one, in main.
class MpiSession {
 public:
  MpiSession(int* argc, char*** argv, bool always = false);
  ~MpiSession();
  MpiSession(const MpiSession&) = delete;
  MpiSession& operator=(const MpiSession&) = delete;
  bool started() const { return started_; }

 private:
  bool started_ = false;
};

struct CommunicatorOptions {
  /// Delay of messages [s], see DelayedMessages; 0: none. Simulated ranks ignore it: their network is slow
  /// anyway.
  double delay = 0;
};

/// All ranks of the session, with the decorators that the build and `options` ask for. A session that was not
/// started, or has one rank, gives a OneRank. Throws std::runtime_error with MPI's message when a call fails.
std::unique_ptr<const Communicator> make_communicator(const MpiSession& session,
                                                      CommunicatorOptions options = {});

/// The same without decorators. Even a single rank uses MPI, and may send messages to itself, which measures
/// what a message costs. The session must be started.
std::unique_ptr<const Communicator> plain_mpi(const MpiSession& session);

}  // namespace talus::graph
