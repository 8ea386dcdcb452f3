/// Gathering by dissemination (Bruck et al. 1997): a rank that holds the parts of h ranks sends them to the
/// rank h places ahead and receives as many from the rank h places behind. That takes ceil(log2(ranks))
/// rounds of one message each way; MPI_Iallgatherv of Open MPI sends ranks - 1 messages from each rank at
/// once.

#include <algorithm>
#include <utility>

#include "runtime/graph/communicator.hpp"
#include "runtime/trace/recorder.hpp"

namespace talus::graph {

PendingGather::PendingGather(const Communicator& ranks, std::vector<double> part,
                             std::span<const std::size_t> lengths)
    : rank_(static_cast<std::size_t>(ranks.rank())),
      ranks_(static_cast<std::size_t>(ranks.ranks())),
      trace_(ranks.trace()) {
  if (ranks_ == 1) {
    all_ = std::move(part);
    return;
  }
  begin_.push_back(0);
  for (const std::size_t length : lengths) begin_.push_back(begin_.back() + length);
  all_.resize(begin_.back());
  std::copy(part.begin(), part.end(), all_.begin() + static_cast<std::ptrdiff_t>(begin_[rank_]));
  round_ = ranks.open_round();
  begin_round();
}

void PendingGather::begin_round() {
  const std::size_t to = (rank_ + have_) % ranks_, from = back(rank_, have_);
  out_.clear();
  std::size_t incoming = 0;
  for (std::size_t k = 0; k < parts(); ++k) {
    const auto part = all_.begin() + static_cast<std::ptrdiff_t>(begin_[back(rank_, k)]);
    out_.insert(out_.end(), part, part + static_cast<std::ptrdiff_t>(length(back(rank_, k))));
    incoming += length(back(from, k));
  }
  in_.resize(incoming);
  round_->begin(static_cast<int>(to), out_, static_cast<int>(from), in_);
}

void PendingGather::end_round() {
  round_->end();
  const std::size_t from = back(rank_, have_);
  auto part = in_.begin();
  for (std::size_t k = 0; k < parts(); ++k) {
    const std::size_t of = back(from, k);
    const auto end = part + static_cast<std::ptrdiff_t>(length(of));
    std::copy(part, end, all_.begin() + static_cast<std::ptrdiff_t>(begin_[of]));
    part = end;
  }
  have_ += parts();
}

const std::vector<double>& PendingGather::wait() {
  if (have_ == ranks_) return all_;
  const trace::Span span(trace_, trace::kind_collective);
  for (;;) {
    end_round();
    if (have_ == ranks_) return all_;
    begin_round();
  }
}

std::unique_ptr<PendingGather> Communicator::start_gather(std::vector<double> part,
                                                          std::span<const std::size_t> lengths) const {
  return std::make_unique<PendingGather>(*this, std::move(part), lengths);
}

}  // namespace talus::graph
