#pragma once

/// A rank alone: no call of MPI is ever made through it.

#include "runtime/graph/communicator.hpp"

namespace talus::graph {

class OneRank final : public Communicator {
 public:
  OneRank() : OneRank(RankProperties{}) {}
  /// Throws std::invalid_argument where `properties` are of several ranks.
  explicit OneRank(RankProperties properties);

  void exchange(std::span<const std::span<const std::byte>> to,
                const std::function<std::byte*(std::size_t, std::size_t)>& room) const override;
  void sum(std::span<std::int64_t> values) const override;
  void max(std::span<double> values) const override;
  std::vector<std::byte> gather(std::span<const std::byte> part) const override;
  void to_first(std::span<const std::byte> part, std::size_t piece,
                const std::function<void(std::span<const std::byte>)>& take) const override;
  [[noreturn]] void abort(int code) const override;
  // There is nobody to send to: these throw std::logic_error.
  std::unique_ptr<Channel> open_send(int to, int tag, std::span<double> buffer) const override;
  std::unique_ptr<Channel> open_receive(int from, int tag, std::span<double> buffer) const override;
  std::unique_ptr<Round> open_round() const override;
  std::unique_ptr<Meeting> start_meeting() const override;

 private:
  /// Records the collective calls that one of several ranks would have made.
  void note_calls(int count, std::size_t bytes = 0) const;
};

/// For programs of one rank.
const Communicator& one_rank();

}  // namespace talus::graph
