#pragma once

/// Time of a simulated machine, for the ranks of a build with TALUS_SMPI.

#include "runtime/graph/communicator.hpp"

namespace talus::graph {

/// A decorator: what the rank has computed since its last call passes on the simulated machine before each
/// call of `inner` (detail::MpiCall). Real ranks take the time they take: theirs is `inner` as it is.
std::unique_ptr<const Communicator> simulated_time(std::unique_ptr<const Communicator> inner);

}  // namespace talus::graph
