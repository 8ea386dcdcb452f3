/// Channels of real ranks: MPI's persistent requests.

#include "runtime/graph/clock.hpp"
#include "runtime/graph/communicator.hpp"

#ifndef TALUS_SMPI

#include <thread>
#include <utility>

#include "runtime/graph/detail/mpi_check.hpp"
#include "runtime/graph/worker.hpp"

namespace talus::graph {

using detail::check;

struct Communicator::Channel::Request {
  MPI_Request handle = MPI_REQUEST_NULL;
  std::span<double> buffer;
  double delay = 0;
  bool sends = false;
  bool open = false;     ///< started and not yet done
  bool arrived = false;  ///< received, but held back
};

Communicator::Channel::Channel(std::unique_ptr<Request> request) : request_(std::move(request)) {}

Communicator::Channel::~Channel() {
  if (!request_ || request_->handle == MPI_REQUEST_NULL) return;
  if (request_->open && !request_->arrived) {
    MPI_Cancel(&request_->handle);
    MPI_Wait(&request_->handle, MPI_STATUS_IGNORE);
  }
  MPI_Request_free(&request_->handle);
}

void Communicator::Channel::start() {
  Request& r = *request_;
  if (r.sends && r.delay > 0) r.buffer.back() = seconds_now();
  check(MPI_Start(&r.handle), "MPI_Start");
  r.open = true;
  r.arrived = false;
}

double Communicator::Channel::wait() {
  const double start = seconds_now();
  for (int polls = 0; !done(); ++polls)
    if (polls < 256)
      pause();
    else
      std::this_thread::yield();
  return seconds_now() - start;
}

bool Communicator::Channel::done() {
  Request& r = *request_;
  if (!r.open) return true;
  if (!r.arrived) {
    int flag = 0;
    check(MPI_Test(&r.handle, &flag, MPI_STATUS_IGNORE), "MPI_Test");
    if (!flag) return false;
    r.arrived = true;
  }
  if (!r.sends && r.delay > 0 && seconds_now() < r.buffer.back() + r.delay) return false;
  r.open = false;
  return true;
}

std::unique_ptr<Communicator::Channel> Communicator::open_send(int to, int tag,
                                                               std::span<double> buffer) const {
  auto request = std::make_unique<Channel::Request>();
  request->buffer = buffer;
  request->delay = options_.delay;
  request->sends = true;
  check(MPI_Send_init(buffer.data(), static_cast<int>(buffer.size()), MPI_DOUBLE, to, tag, MPI_COMM_WORLD,
                      &request->handle),
        "MPI_Send_init");
  return std::unique_ptr<Channel>(new Channel(std::move(request)));
}

std::unique_ptr<Communicator::Channel> Communicator::open_receive(int from, int tag,
                                                                  std::span<double> buffer) const {
  auto request = std::make_unique<Channel::Request>();
  request->buffer = buffer;
  request->delay = options_.delay;
  check(MPI_Recv_init(buffer.data(), static_cast<int>(buffer.size()), MPI_DOUBLE, from, tag, MPI_COMM_WORLD,
                      &request->handle),
        "MPI_Recv_init");
  return std::unique_ptr<Channel>(new Channel(std::move(request)));
}

}  // namespace talus::graph

#endif
