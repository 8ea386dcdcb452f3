#pragma once

/// Channels of MPI (Communicator::open_send): persistent requests, or plain messages on simulated ranks.

#include <memory>
#include <span>

#include "runtime/graph/communicator.hpp"

namespace talus::graph::detail {

std::unique_ptr<Channel> mpi_sender(int to, int tag, std::span<double> buffer);
std::unique_ptr<Channel> mpi_receiver(int from, int tag, std::span<double> buffer);

}  // namespace talus::graph::detail
