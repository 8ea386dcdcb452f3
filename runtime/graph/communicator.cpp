#include "runtime/graph/communicator.hpp"

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <thread>
#include <utility>

#include "runtime/graph/clock.hpp"
#include "runtime/graph/detail/mpi_check.hpp"
#include "runtime/trace/recorder.hpp"

namespace talus::graph {

namespace {

using detail::check;
using detail::MpiCall;

/// Started by a launcher of some kind: Open MPI, MPICH and Intel MPI, or Slurm with PMIx.
bool launched() {
  if (simulated_ranks) return true;
  for (const char* name : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "PMIX_RANK"})
    if (std::getenv(name)) return true;
  return false;
}

/// What MPI counts with; throws std::runtime_error for more.
int byte_count(std::uint64_t bytes) {
  if (bytes > static_cast<std::uint64_t>(std::numeric_limits<int>::max()))
    throw std::runtime_error("a message of more than 2 GiB between ranks; use more ranks");
  return static_cast<int>(bytes);
}

}  // namespace

void demand_thread_level(const std::string& level, int ranks, int threads) {
  if (ranks == 1 || threads == 1 || level == "serialized" || level == "multiple") return;
  throw std::invalid_argument("MPI lets one thread of a rank call it (MPI_Query_thread: " + level +
                              "), and " + std::to_string(threads) +
                              " threads would: use --threads 1 and more ranks, or an MPI built for threads");
}

MpiSession::MpiSession(int* argc, char*** argv, bool always) {
  if (!always && !launched()) return;
  int level = 0;
  check(MPI_Init_thread(argc, argv, MPI_THREAD_MULTIPLE, &level), "MPI_Init_thread");
  // By default MPI ends the program itself; check() would never throw.
  check(MPI_Comm_set_errhandler(MPI_COMM_WORLD, MPI_ERRORS_RETURN), "MPI_Comm_set_errhandler");
  started_ = true;
  MpiCall::begin_rank();
}

MpiSession::~MpiSession() {
  if (started_) MPI_Finalize();
}

Communicator::Communicator() = default;

Communicator::Communicator(const MpiSession& session, CommunicatorOptions options) : options_(options) {
  if (!session.started()) return;
  const MpiCall call;
  check(MPI_Comm_rank(MPI_COMM_WORLD, &rank_), "MPI_Comm_rank");
  check(MPI_Comm_size(MPI_COMM_WORLD, &ranks_), "MPI_Comm_size");
  int level = 0;
  check(MPI_Query_thread(&level), "MPI_Query_thread");
  any_thread_ = level == MPI_THREAD_MULTIPLE;
  int* largest = nullptr;
  int given = 0;
  check(MPI_Comm_get_attr(MPI_COMM_WORLD, MPI_TAG_UB, static_cast<void*>(&largest), &given),
        "MPI_Comm_get_attr");
  if (given != 0)
    largest_tag_ = simulated_ranks ? std::numeric_limits<int>::max() : *largest;  // SMPI takes any
  MPI_Comm node;
  check(MPI_Comm_split_type(MPI_COMM_WORLD, MPI_COMM_TYPE_SHARED, rank_, MPI_INFO_NULL, &node),
        "MPI_Comm_split_type");
  check(MPI_Comm_size(node, &ranks_on_node_), "MPI_Comm_size");
  MPI_Comm_free(&node);
}

Communicator::~Communicator() = default;

const Communicator& one_rank() {
  static const Communicator alone;
  return alone;
}

std::string Communicator::thread_level() const {
  int started = 0;
  MPI_Initialized(&started);
  if (!started) return "none";
  int level = 0;
  MPI_Query_thread(&level);
  return level == MPI_THREAD_MULTIPLE     ? "multiple"
         : level == MPI_THREAD_SERIALIZED ? "serialized"
         : level == MPI_THREAD_FUNNELED   ? "funneled"
                                          : "single";
}

void Communicator::note_calls(int count, std::uint32_t bytes) const {
  for (int k = 0; k < count; ++k) const trace::Span span(trace_, trace::kind_collective, bytes);
}

void Communicator::exchange(std::span<const std::span<const std::byte>> to,
                            const std::function<std::byte*(std::size_t, std::size_t)>& room) const {
  const auto n = static_cast<std::size_t>(ranks_), own = static_cast<std::size_t>(rank_);
  if (to.size() != n) throw std::invalid_argument("Communicator::exchange wants one part per rank");
  if (n == 1) return note_calls(2);
  const MpiCall call;
  trace::Span sizes(trace_, trace::kind_collective);
  std::vector<std::uint64_t> out_bytes(n, 0), in_bytes(n);
  for (std::size_t r = 0; r < n; ++r)
    if (r != own) out_bytes[r] = to[r].size();
  check(MPI_Alltoall(out_bytes.data(), 1, MPI_UINT64_T, in_bytes.data(), 1, MPI_UINT64_T, MPI_COMM_WORLD),
        "MPI_Alltoall");
  sizes.end();
  const trace::Span parts(trace_, trace::kind_collective);
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

void Communicator::sum(std::span<std::int64_t> values) const {
  if (values.empty()) return;  // SimGrid's calls divide by their number
  const auto bytes = static_cast<std::uint32_t>(values.size_bytes());
  if (ranks_ == 1) return note_calls(1, bytes);
  const MpiCall call;
  const trace::Span span(trace_, trace::kind_collective, bytes);
  check(MPI_Allreduce(MPI_IN_PLACE, values.data(), static_cast<int>(values.size()), MPI_INT64_T, MPI_SUM,
                      MPI_COMM_WORLD),
        "MPI_Allreduce");
}

void Communicator::max(std::span<double> values) const {
  if (values.empty()) return;  // SimGrid's calls divide by their number
  const auto bytes = static_cast<std::uint32_t>(values.size_bytes());
  if (ranks_ == 1) return note_calls(1, bytes);
  const MpiCall call;
  const trace::Span span(trace_, trace::kind_collective, bytes);
  check(MPI_Allreduce(MPI_IN_PLACE, values.data(), static_cast<int>(values.size()), MPI_DOUBLE, MPI_MAX,
                      MPI_COMM_WORLD),
        "MPI_Allreduce");
}

std::vector<std::byte> Communicator::gather(std::span<const std::byte> part) const {
  if (ranks_ == 1) {
    note_calls(2);
    return {part.begin(), part.end()};
  }
  const MpiCall call;
  trace::Span sizes(trace_, trace::kind_collective);
  const auto n = static_cast<std::size_t>(ranks_);
  const std::uint64_t own = part.size();
  std::vector<std::uint64_t> sizes_of(n);
  check(MPI_Allgather(&own, 1, MPI_UINT64_T, sizes_of.data(), 1, MPI_UINT64_T, MPI_COMM_WORLD),
        "MPI_Allgather");
  sizes.end();
  const trace::Span parts(trace_, trace::kind_collective);
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

void Communicator::to_first(std::span<const std::byte> part, std::size_t piece,
                            const std::function<void(std::span<const std::byte>)>& take) const {
  const auto in_pieces = [piece](std::size_t bytes, const auto& work) {
    for (std::size_t begin = 0; begin < bytes; begin += piece) work(begin, std::min(piece, bytes - begin));
  };
  if (ranks_ == 1) {
    in_pieces(part.size(), [&](std::size_t begin, std::size_t size) { take(part.subspan(begin, size)); });
    return;
  }
  const MpiCall call;
  if (rank_ != 0) {
    const std::uint64_t bytes = part.size();
    check(MPI_Send(&bytes, 1, MPI_UINT64_T, 0, 0, MPI_COMM_WORLD), "MPI_Send");
    in_pieces(part.size(), [&](std::size_t begin, std::size_t size) {
      check(MPI_Send(part.data() + begin, static_cast<int>(size), MPI_BYTE, 0, 0, MPI_COMM_WORLD),
            "MPI_Send");
    });
    return;
  }
  in_pieces(part.size(), [&](std::size_t begin, std::size_t size) { take(part.subspan(begin, size)); });
  std::vector<std::byte> received;
  for (int rank = 1; rank < ranks_; ++rank) {
    std::uint64_t bytes = 0;
    check(MPI_Recv(&bytes, 1, MPI_UINT64_T, rank, 0, MPI_COMM_WORLD, MPI_STATUS_IGNORE), "MPI_Recv");
    in_pieces(bytes, [&](std::size_t, std::size_t size) {
      received.resize(size);
      check(MPI_Recv(received.data(), static_cast<int>(size), MPI_BYTE, rank, 0, MPI_COMM_WORLD,
                     MPI_STATUS_IGNORE),
            "MPI_Recv");
      take(received);
    });
  }
}

void Communicator::progress() const {
  if (simulated_ranks) return;  // a simulated network needs nobody's help
  int flag = 0;
  MPI_Iprobe(MPI_ANY_SOURCE, MPI_ANY_TAG, MPI_COMM_SELF, &flag, MPI_STATUS_IGNORE);
}

void Communicator::meet(double seconds) const {
  if (ranks_ == 1) return;
  const double end = seconds_now() + seconds;
  MPI_Request all;
  {
    const MpiCall call;
    check(MPI_Ibarrier(MPI_COMM_WORLD, &all), "MPI_Ibarrier");
  }
  int here = 0;
  while (!here && seconds_now() < end) {
    {
      // One each time: simulated ranks have time pass between calls only.
      const MpiCall call;
      check(MPI_Test(&all, &here, MPI_STATUS_IGNORE), "MPI_Test");
    }
    std::this_thread::yield();
  }
}

void Communicator::abort(int code) const {
  if (ranks_ > 1) MPI_Abort(MPI_COMM_WORLD, code);
  std::exit(code);
}

}  // namespace talus::graph
