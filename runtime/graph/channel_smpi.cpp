/// Channels of simulated ranks. SMPI 3.32 loses a persistent message that is sent again before the first was
/// taken, and crashes in MPI_Cancel, so these are plain messages: sent at once into a buffer of SMPI's, as
/// the platform says (io::smpi_platform), and taken when somebody waits for them.

#include "runtime/graph/communicator.hpp"

#ifdef TALUS_SMPI

#include <simgrid/engine.h>

#include <utility>

#include "runtime/graph/detail/mpi_check.hpp"

namespace talus::graph {

using detail::check;

struct Communicator::Channel::Request {
  std::span<double> buffer;
  int other = 0, tag = 0;
  bool sends = false;
  bool open = false;  ///< a receiver that waits for a message
};

Communicator::Channel::Channel(std::unique_ptr<Request> request) : request_(std::move(request)) {}

Communicator::Channel::~Channel() = default;

void Communicator::Channel::start() {
  const Request& r = *request_;
  const detail::MpiCall call;
  if (r.sends)
    check(MPI_Send(r.buffer.data(), static_cast<int>(r.buffer.size()), MPI_DOUBLE, r.other, r.tag,
                   MPI_COMM_WORLD),
          "MPI_Send");
  request_->open = !r.sends;
}

bool Communicator::Channel::done() {
  return !request_->open;
}

double Communicator::Channel::wait() {
  const Request& r = *request_;
  if (!r.open) return 0;
  const detail::MpiCall call(true);
  const double start = simgrid_get_clock();
  check(MPI_Recv(r.buffer.data(), static_cast<int>(r.buffer.size()), MPI_DOUBLE, r.other, r.tag,
                 MPI_COMM_WORLD, MPI_STATUS_IGNORE),
        "MPI_Recv");
  request_->open = false;
  return simgrid_get_clock() - start;
}

std::unique_ptr<Communicator::Channel> Communicator::open_send(int to, int tag,
                                                               std::span<double> buffer) const {
  return std::unique_ptr<Channel>(
      new Channel(std::make_unique<Channel::Request>(Channel::Request{buffer, to, tag, true, false})));
}

std::unique_ptr<Communicator::Channel> Communicator::open_receive(int from, int tag,
                                                                  std::span<double> buffer) const {
  return std::unique_ptr<Channel>(
      new Channel(std::make_unique<Channel::Request>(Channel::Request{buffer, from, tag, false, false})));
}

}  // namespace talus::graph

#endif
