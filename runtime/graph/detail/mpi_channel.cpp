#include "runtime/graph/detail/mpi_channel.hpp"

#ifndef TALUS_SMPI

#include "runtime/graph/detail/mpi_check.hpp"

namespace talus::graph::detail {

namespace {

/// A persistent request. The functions below create it.
class MpiChannel final : public Channel {
 public:
  ~MpiChannel() override {
    if (handle == MPI_REQUEST_NULL) return;
    if (open_) {
      MPI_Cancel(&handle);
      MPI_Wait(&handle, MPI_STATUS_IGNORE);
    }
    MPI_Request_free(&handle);
  }
  void start() override {
    check(MPI_Start(&handle), "MPI_Start");
    open_ = true;
  }
  bool done() override {
    if (!open_) return true;
    int flag = 0;
    check(MPI_Test(&handle, &flag, MPI_STATUS_IGNORE), "MPI_Test");
    open_ = flag == 0;
    return !open_;
  }
  MPI_Request handle = MPI_REQUEST_NULL;

 private:
  bool open_ = false;  ///< started and not yet done
};

}  // namespace

std::unique_ptr<Channel> mpi_sender(int to, int tag, std::span<double> buffer) {
  auto channel = std::make_unique<MpiChannel>();
  check(MPI_Send_init(buffer.data(), static_cast<int>(buffer.size()), MPI_DOUBLE, to, tag, MPI_COMM_WORLD,
                      &channel->handle),
        "MPI_Send_init");
  return channel;
}

std::unique_ptr<Channel> mpi_receiver(int from, int tag, std::span<double> buffer) {
  auto channel = std::make_unique<MpiChannel>();
  check(MPI_Recv_init(buffer.data(), static_cast<int>(buffer.size()), MPI_DOUBLE, from, tag, MPI_COMM_WORLD,
                      &channel->handle),
        "MPI_Recv_init");
  return channel;
}

}  // namespace talus::graph::detail

#endif
