/// Gathering by dissemination (Bruck et al. 1997): with parts of h ranks at hand, each rank sends them to the
/// one h places on and takes as many from the one h places back. ceil(log2(ranks)) rounds of one message each
/// way; MPI_Iallgatherv of Open MPI sends ranks - 1 messages from each rank at once.

#include <algorithm>
#include <utility>

#include "runtime/graph/communicator.hpp"
#include "runtime/graph/detail/mpi_check.hpp"
#include "runtime/trace/recorder.hpp"

namespace talus::graph {

using detail::check;

struct Communicator::PendingGather::Request {
  std::size_t rank = 0, ranks = 1;
  std::size_t have = 1;            ///< parts: this rank's and those of the ranks before it, around the ring
  std::vector<std::size_t> begin;  ///< ranks + 1, in `all`
  std::vector<double> all, out, in;
  MPI_Request handles[2] = {MPI_REQUEST_NULL, MPI_REQUEST_NULL};
  trace::Recorder* trace = nullptr;

  std::size_t back(std::size_t from, std::size_t places) const { return (from + ranks - places) % ranks; }
  std::size_t parts() const { return std::min(have, ranks - have); }  ///< in the message of a round
  std::size_t length(std::size_t of) const { return begin[of + 1] - begin[of]; }

  void begin_round() {
    const detail::MpiCall call;
    const std::size_t to = (rank + have) % ranks, from = back(rank, have);
    out.clear();
    std::size_t incoming = 0;
    for (std::size_t k = 0; k < parts(); ++k) {
      const auto part = all.begin() + static_cast<std::ptrdiff_t>(begin[back(rank, k)]);
      out.insert(out.end(), part, part + static_cast<std::ptrdiff_t>(length(back(rank, k))));
      incoming += length(back(from, k));
    }
    in.resize(incoming);
    check(MPI_Irecv(in.data(), static_cast<int>(in.size()), MPI_DOUBLE, static_cast<int>(from), gather_tag,
                    MPI_COMM_WORLD, &handles[0]),
          "MPI_Irecv");
    check(MPI_Isend(out.data(), static_cast<int>(out.size()), MPI_DOUBLE, static_cast<int>(to), gather_tag,
                    MPI_COMM_WORLD, &handles[1]),
          "MPI_Isend");
  }
  void end_round() {
    const detail::MpiCall call(true);
    check(MPI_Waitall(2, handles, MPI_STATUSES_IGNORE), "MPI_Waitall");
    const std::size_t from = back(rank, have);
    auto part = in.begin();
    for (std::size_t k = 0; k < parts(); ++k) {
      const std::size_t of = back(from, k);
      const auto end = part + static_cast<std::ptrdiff_t>(length(of));
      std::copy(part, end, all.begin() + static_cast<std::ptrdiff_t>(begin[of]));
      part = end;
    }
    have += parts();
  }
};

Communicator::PendingGather::PendingGather(std::unique_ptr<Request> request) : request_(std::move(request)) {}

Communicator::PendingGather::~PendingGather() = default;

const std::vector<double>& Communicator::PendingGather::wait() {
  Request& r = *request_;
  if (r.have == r.ranks) return r.all;
  const trace::Span span(r.trace, trace::kind_collective);
  for (;;) {
    r.end_round();
    if (r.have == r.ranks) return r.all;
    r.begin_round();
  }
}

std::unique_ptr<Communicator::PendingGather> Communicator::start_gather(
    std::vector<double> part, std::span<const std::size_t> lengths) const {
  auto request = std::make_unique<PendingGather::Request>();
  PendingGather::Request& r = *request;
  if (ranks_ == 1) {
    r.all = std::move(part);
    return std::unique_ptr<PendingGather>(new PendingGather(std::move(request)));
  }
  r.rank = static_cast<std::size_t>(rank_);
  r.ranks = static_cast<std::size_t>(ranks_);
  r.trace = trace_;
  r.begin.push_back(0);
  for (const std::size_t length : lengths) r.begin.push_back(r.begin.back() + length);
  r.all.resize(r.begin.back());
  std::copy(part.begin(), part.end(), r.all.begin() + static_cast<std::ptrdiff_t>(r.begin[r.rank]));
  r.begin_round();
  return std::unique_ptr<PendingGather>(new PendingGather(std::move(request)));
}

}  // namespace talus::graph
