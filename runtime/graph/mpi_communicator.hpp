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
  /// [s] of DelayedMessages; 0: none. A simulated machine has a network of its own, which is slow enough.
  double delay = 0;
};

/// All ranks of the session, with the decorators that the build and `options` ask for. A session that was not
/// started, or has one rank, gives a OneRank. Throws std::runtime_error with the words of MPI where it fails.
std::unique_ptr<const Communicator> make_communicator(const MpiSession& session,
                                                      CommunicatorOptions options = {});

/// The same without decorators, and through MPI even of one rank, which may send messages to itself then:
/// what a message costs can be measured so. The session must be started.
std::unique_ptr<const Communicator> plain_mpi(const MpiSession& session);

}  // namespace talus::graph
