#pragma once

/// Time of a simulated machine, for the ranks of a build with TALUS_SMPI.

#include "runtime/graph/communicator.hpp"

namespace talus::graph {

/// A decorator: before each call of `inner` the simulated clock advances by the rank's computing time since
/// its last call (detail::MpiCall). In a build for real ranks it returns `inner` itself.
std::unique_ptr<const Communicator> simulated_time(std::unique_ptr<const Communicator> inner);

}  // namespace talus::graph
