/// Channels of simulated ranks, by plain messages: SMPI 3.32 loses a persistent message that is sent again
/// before the first was received, and crashes in MPI_Cancel. A message is sent at once into a buffer of
/// SMPI's, as the platform says (io::smpi_platform), and received in wait().

#include "runtime/graph/detail/mpi_channel.hpp"

#ifdef TALUS_SMPI

#include <simgrid/engine.h>

#include "runtime/graph/detail/mpi_check.hpp"

namespace talus::graph::detail {

namespace {

class Sender final : public Channel {
 public:
  Sender(int to, int tag, std::span<double> buffer) : buffer_(buffer), to_(to), tag_(tag) {}
  void start() override {
    check(MPI_Send(buffer_.data(), static_cast<int>(buffer_.size()), MPI_DOUBLE, to_, tag_, MPI_COMM_WORLD),
          "MPI_Send");
  }
  bool done() override { return true; }
  double wait() override { return 0; }

 private:
  std::span<double> buffer_;
  int to_, tag_;
};

class Receiver final : public Channel {
 public:
  Receiver(int from, int tag, std::span<double> buffer) : buffer_(buffer), from_(from), tag_(tag) {}
  void start() override { open_ = true; }
  bool done() override { return !open_; }
  double wait() override {
    if (!open_) return 0;
    const double start = simgrid_get_clock();
    check(MPI_Recv(buffer_.data(), static_cast<int>(buffer_.size()), MPI_DOUBLE, from_, tag_, MPI_COMM_WORLD,
                   MPI_STATUS_IGNORE),
          "MPI_Recv");
    open_ = false;
    return simgrid_get_clock() - start;
  }

 private:
  std::span<double> buffer_;
  int from_, tag_;
  bool open_ = false;  ///< waits for a message
};

}  // namespace

std::unique_ptr<Channel> mpi_sender(int to, int tag, std::span<double> buffer) {
  return std::make_unique<Sender>(to, tag, buffer);
}

std::unique_ptr<Channel> mpi_receiver(int from, int tag, std::span<double> buffer) {
  return std::make_unique<Receiver>(from, tag, buffer);
}

}  // namespace talus::graph::detail

#endif
