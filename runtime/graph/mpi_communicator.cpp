#include "runtime/graph/mpi_communicator.hpp"

#include <algorithm>
#include <cstdlib>
#include <limits>

#include "runtime/graph/clock.hpp"
#include "runtime/graph/delayed_messages.hpp"
#include "runtime/graph/detail/mpi_call.hpp"
#include "runtime/graph/detail/mpi_channel.hpp"
#include "runtime/graph/detail/mpi_check.hpp"
#include "runtime/graph/detail/pieces.hpp"
#include "runtime/graph/one_rank.hpp"
#include "runtime/graph/simulated_time.hpp"
#include "runtime/trace/recorder.hpp"

namespace talus::graph {

namespace {

using detail::check;

/// Started by a launcher of some kind: Open MPI, MPICH and Intel MPI, or Slurm with PMIx.
bool launched() {
  if (simulated_ranks) return true;
  for (const char* name : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "PMIX_RANK"})
    if (std::getenv(name)) return true;
  return false;
}

/// Converts to int, in which MPI counts; throws std::runtime_error if that is too small.
int byte_count(std::uint64_t bytes) {
  if (bytes > static_cast<std::uint64_t>(std::numeric_limits<int>::max()))
    throw std::runtime_error("a message of more than 2 GiB between ranks; use more ranks");
  return static_cast<int>(bytes);
}

std::string name_of_level(int level) {
  return level == MPI_THREAD_MULTIPLE     ? "multiple"
         : level == MPI_THREAD_SERIALIZED ? "serialized"
         : level == MPI_THREAD_FUNNELED   ? "funneled"
                                          : "single";
}

RankProperties properties_of_world() {
  const detail::MpiCall call;
  RankProperties own;
  check(MPI_Comm_rank(MPI_COMM_WORLD, &own.rank), "MPI_Comm_rank");
  check(MPI_Comm_size(MPI_COMM_WORLD, &own.ranks), "MPI_Comm_size");
  int level = 0;
  check(MPI_Query_thread(&level), "MPI_Query_thread");
  own.thread_level = name_of_level(level);
  own.any_thread = level == MPI_THREAD_MULTIPLE;
  int* largest = nullptr;
  int given = 0;
  check(MPI_Comm_get_attr(MPI_COMM_WORLD, MPI_TAG_UB, static_cast<void*>(&largest), &given),
        "MPI_Comm_get_attr");
  if (given != 0)
    own.largest_tag = simulated_ranks ? std::numeric_limits<int>::max() : *largest;  // SMPI takes any
  MPI_Comm node;
  check(MPI_Comm_split_type(MPI_COMM_WORLD, MPI_COMM_TYPE_SHARED, own.rank, MPI_INFO_NULL, &node),
        "MPI_Comm_split_type");
  check(MPI_Comm_size(node, &own.ranks_on_node), "MPI_Comm_size");
  MPI_Comm_free(&node);
  return own;
}

class MpiRound final : public Round {
 public:
  void begin(int to, std::span<const double> out, int from, std::span<double> in) override {
    check(MPI_Irecv(in.data(), static_cast<int>(in.size()), MPI_DOUBLE, from, Communicator::gather_tag,
                    MPI_COMM_WORLD, &handles_[0]),
          "MPI_Irecv");
    check(MPI_Isend(out.data(), static_cast<int>(out.size()), MPI_DOUBLE, to, Communicator::gather_tag,
                    MPI_COMM_WORLD, &handles_[1]),
          "MPI_Isend");
  }
  void end() override { check(MPI_Waitall(2, handles_, MPI_STATUSES_IGNORE), "MPI_Waitall"); }

 private:
  MPI_Request handles_[2] = {MPI_REQUEST_NULL, MPI_REQUEST_NULL};
};

class MpiMeeting final : public Meeting {
 public:
  MpiMeeting() { check(MPI_Ibarrier(MPI_COMM_WORLD, &all_), "MPI_Ibarrier"); }
  bool complete() override {
    int here = 0;
    check(MPI_Test(&all_, &here, MPI_STATUS_IGNORE), "MPI_Test");
    return here != 0;
  }

 private:
  MPI_Request all_ = MPI_REQUEST_NULL;
};

class MpiCommunicator final : public Communicator {
 public:
  explicit MpiCommunicator(RankProperties properties) : Communicator(std::move(properties)) {}

  std::vector<std::byte> gather(std::span<const std::byte> part) const override;
  void to_first(std::span<const std::byte> part, std::size_t piece,
                const std::function<void(std::span<const std::byte>)>& take) const override;
  void sum(std::span<std::int64_t> values) const override;
  void max(std::span<double> values) const override;
  void exchange(std::span<const std::span<const std::byte>> to,
                const std::function<std::byte*(std::size_t, std::size_t)>& room) const override;
  void progress() const override {
    if (simulated_ranks) return;  // a simulated network needs nobody's help
    int flag = 0;
    MPI_Iprobe(MPI_ANY_SOURCE, MPI_ANY_TAG, MPI_COMM_SELF, &flag, MPI_STATUS_IGNORE);
  }
  [[noreturn]] void abort(int code) const override {
    // MPI_Abort of SMPI 3.32 forgets the code; all simulated ranks are in this process.
    if (simulated_ranks) std::_Exit(code);
    MPI_Abort(MPI_COMM_WORLD, code);
    std::exit(code);
  }
  std::unique_ptr<Channel> open_send(int to, int tag, std::span<double> buffer) const override {
    return detail::mpi_sender(to, tag, buffer);
  }
  std::unique_ptr<Channel> open_receive(int from, int tag, std::span<double> buffer) const override {
    return detail::mpi_receiver(from, tag, buffer);
  }
  std::unique_ptr<Round> open_round() const override { return std::make_unique<MpiRound>(); }
  std::unique_ptr<Meeting> start_meeting() const override { return std::make_unique<MpiMeeting>(); }
};

void MpiCommunicator::exchange(std::span<const std::span<const std::byte>> to,
                               const std::function<std::byte*(std::size_t, std::size_t)>& room) const {
  const auto n = static_cast<std::size_t>(ranks()), own = static_cast<std::size_t>(rank());
  if (to.size() != n) throw std::invalid_argument("Communicator::exchange wants one part per rank");
  trace::Span sizes(trace(), trace::kind_collective);
  std::vector<std::uint64_t> out_bytes(n, 0), in_bytes(n);
  for (std::size_t r = 0; r < n; ++r)
    if (r != own) out_bytes[r] = to[r].size();
  check(MPI_Alltoall(out_bytes.data(), 1, MPI_UINT64_T, in_bytes.data(), 1, MPI_UINT64_T, MPI_COMM_WORLD),
        "MPI_Alltoall");
  sizes.end();
  const trace::Span parts(trace(), trace::kind_collective);
  for (std::size_t r = 0; r < n; ++r) byte_count(std::max(out_bytes[r], in_bytes[r]));
  std::vector<MPI_Request> requests;
  for (std::size_t r = 0; r < n; ++r)
    if (in_bytes[r] > 0)
      check(MPI_Irecv(room(r, in_bytes[r]), byte_count(in_bytes[r]), MPI_BYTE, static_cast<int>(r), 0,
                      MPI_COMM_WORLD, &requests.emplace_back()),
            "MPI_Irecv");
  for (std::size_t r = 0; r < n; ++r)
    if (out_bytes[r] > 0)
      check(MPI_Isend(to[r].data(), byte_count(out_bytes[r]), MPI_BYTE, static_cast<int>(r), 0,
                      MPI_COMM_WORLD, &requests.emplace_back()),
            "MPI_Isend");
  check(MPI_Waitall(static_cast<int>(requests.size()), requests.data(), MPI_STATUSES_IGNORE), "MPI_Waitall");
}

/// Reduces each value over all ranks, in place.
template <class Number>
void reduce_values(std::span<Number> values, MPI_Datatype type, MPI_Op op, trace::Recorder* trace) {
  if (values.empty()) return;  // SimGrid divides by the number of values
  const trace::Span span(trace, trace::kind_collective, static_cast<std::uint32_t>(values.size_bytes()));
  check(MPI_Allreduce(MPI_IN_PLACE, values.data(), static_cast<int>(values.size()), type, op, MPI_COMM_WORLD),
        "MPI_Allreduce");
}

void MpiCommunicator::sum(std::span<std::int64_t> values) const {
  reduce_values(values, MPI_INT64_T, MPI_SUM, trace());
}

void MpiCommunicator::max(std::span<double> values) const {
  reduce_values(values, MPI_DOUBLE, MPI_MAX, trace());
}

std::vector<std::byte> MpiCommunicator::gather(std::span<const std::byte> part) const {
  trace::Span sizes(trace(), trace::kind_collective);
  const auto n = static_cast<std::size_t>(ranks());
  const std::uint64_t own = part.size();
  std::vector<std::uint64_t> sizes_of(n);
  check(MPI_Allgather(&own, 1, MPI_UINT64_T, sizes_of.data(), 1, MPI_UINT64_T, MPI_COMM_WORLD),
        "MPI_Allgather");
  sizes.end();
  const trace::Span parts(trace(), trace::kind_collective);
  std::uint64_t total = 0;
  std::vector<int> bytes, begin;
  for (const std::uint64_t size : sizes_of) {
    begin.push_back(byte_count(total));
    bytes.push_back(byte_count(size));
    total += size;
  }
  if (total == 0) return {};
  std::vector<std::byte> all(static_cast<std::size_t>(byte_count(total)));
  check(MPI_Allgatherv(part.data(), byte_count(own), MPI_BYTE, all.data(), bytes.data(), begin.data(),
                       MPI_BYTE, MPI_COMM_WORLD),
        "MPI_Allgatherv");
  return all;
}

void MpiCommunicator::to_first(std::span<const std::byte> part, std::size_t piece,
                               const std::function<void(std::span<const std::byte>)>& take) const {
  if (rank() != 0) {
    const std::uint64_t bytes = part.size();
    check(MPI_Send(&bytes, 1, MPI_UINT64_T, 0, 0, MPI_COMM_WORLD), "MPI_Send");
    detail::each_piece(part, piece, [](std::span<const std::byte> bytes_of_piece) {
      check(MPI_Send(bytes_of_piece.data(), static_cast<int>(bytes_of_piece.size()), MPI_BYTE, 0, 0,
                     MPI_COMM_WORLD),
            "MPI_Send");
    });
    return;
  }
  detail::each_piece(part, piece, take);
  std::vector<std::byte> received;
  for (int rank = 1; rank < ranks(); ++rank) {
    std::uint64_t bytes = 0;
    check(MPI_Recv(&bytes, 1, MPI_UINT64_T, rank, 0, MPI_COMM_WORLD, MPI_STATUS_IGNORE), "MPI_Recv");
    detail::in_pieces(bytes, piece, [&](std::size_t, std::size_t size) {
      received.resize(size);
      check(MPI_Recv(received.data(), static_cast<int>(size), MPI_BYTE, rank, 0, MPI_COMM_WORLD,
                     MPI_STATUS_IGNORE),
            "MPI_Recv");
      take(received);
    });
  }
}

}  // namespace

MpiSession::MpiSession(int* argc, char*** argv, bool always) {
  if (!always && !launched()) return;
  int level = 0;
  check(MPI_Init_thread(argc, argv, MPI_THREAD_MULTIPLE, &level), "MPI_Init_thread");
  // By default MPI ends the program itself; check() would never throw.
  check(MPI_Comm_set_errhandler(MPI_COMM_WORLD, MPI_ERRORS_RETURN), "MPI_Comm_set_errhandler");
  started_ = true;
  detail::MpiCall::begin_rank();
}

MpiSession::~MpiSession() {
  if (started_) MPI_Finalize();
}

std::unique_ptr<const Communicator> plain_mpi(const MpiSession& session) {
  if (!session.started()) throw std::logic_error("MPI was not started");
  return std::make_unique<MpiCommunicator>(properties_of_world());
}

std::unique_ptr<const Communicator> make_communicator(const MpiSession& session,
                                                      CommunicatorOptions options) {
  if (!session.started()) return std::make_unique<OneRank>();
  std::unique_ptr<const Communicator> ranks = plain_mpi(session);
  if (ranks->ranks() == 1) return std::make_unique<OneRank>(ranks->properties());
  if (simulated_ranks) return simulated_time(std::move(ranks));
  if (options.delay > 0) return std::make_unique<DelayedMessages>(std::move(ranks), options.delay);
  return ranks;
}

}  // namespace talus::graph
