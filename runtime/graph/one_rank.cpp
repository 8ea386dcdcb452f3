#include "runtime/graph/one_rank.hpp"

#include <cstdlib>

#include "runtime/graph/detail/pieces.hpp"
#include "runtime/trace/recorder.hpp"

namespace talus::graph {

namespace {

[[noreturn]] void nobody_else() {
  throw std::logic_error("a rank alone has nobody to send messages to");
}

}  // namespace

OneRank::OneRank(RankProperties properties) : Communicator(std::move(properties)) {
  if (ranks() != 1) throw std::invalid_argument("OneRank for " + std::to_string(ranks()) + " ranks");
}

const Communicator& one_rank() {
  static const OneRank alone;
  return alone;
}

void OneRank::note_calls(int count, std::size_t bytes) const {
  for (int k = 0; k < count; ++k)
    const trace::Span span(trace(), trace::kind_collective, static_cast<std::uint32_t>(bytes));
}

void OneRank::exchange(std::span<const std::span<const std::byte>> to,
                       const std::function<std::byte*(std::size_t, std::size_t)>& /*room*/) const {
  if (to.size() != 1) throw std::invalid_argument("Communicator::exchange wants one part per rank");
  note_calls(2);
}

void OneRank::sum(std::span<std::int64_t> values) const {
  if (!values.empty()) note_calls(1, values.size_bytes());
}

void OneRank::max(std::span<double> values) const {
  if (!values.empty()) note_calls(1, values.size_bytes());
}

std::vector<std::byte> OneRank::gather(std::span<const std::byte> part) const {
  note_calls(2);
  return {part.begin(), part.end()};
}

void OneRank::to_first(std::span<const std::byte> part, std::size_t piece,
                       const std::function<void(std::span<const std::byte>)>& take) const {
  detail::each_piece(part, piece, take);
}

void OneRank::abort(int code) const {
  std::exit(code);
}

std::unique_ptr<Channel> OneRank::open_send(int, int, std::span<double>) const {
  nobody_else();
}
std::unique_ptr<Channel> OneRank::open_receive(int, int, std::span<double>) const {
  nobody_else();
}
std::unique_ptr<Round> OneRank::open_round() const {
  nobody_else();
}
std::unique_ptr<Meeting> OneRank::start_meeting() const {
  nobody_else();
}

}  // namespace talus::graph
