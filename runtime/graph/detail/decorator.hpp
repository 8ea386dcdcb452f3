#pragma once

/// A communicator that passes every call on to another one; decorators override what they add to.

#include <cstdlib>

#include "runtime/graph/communicator.hpp"

namespace talus::graph::detail {

class Decorator : public Communicator {
 public:
  void record_to(trace::Recorder* trace) const override {
    Communicator::record_to(trace);
    inner().record_to(trace);
  }
  void exchange(std::span<const std::span<const std::byte>> to,
                const std::function<std::byte*(std::size_t, std::size_t)>& room) const override {
    inner().exchange(to, room);
  }
  void sum(std::span<std::int64_t> values) const override { inner().sum(values); }
  void max(std::span<double> values) const override { inner().max(values); }
  std::vector<std::byte> gather(std::span<const std::byte> part) const override {
    return inner().gather(part);
  }
  void to_first(std::span<const std::byte> part, std::size_t piece,
                const std::function<void(std::span<const std::byte>)>& take) const override {
    inner().to_first(part, piece, take);
  }
  void progress() const override { inner().progress(); }
  [[noreturn]] void abort(int code) const override {
    inner().abort(code);
    std::exit(code);  // g++ 12 does not see that the virtual call above never returns
  }
  std::unique_ptr<Channel> open_send(int to, int tag, std::span<double> buffer) const override {
    return inner().open_send(to, tag, buffer);
  }
  std::unique_ptr<Channel> open_receive(int from, int tag, std::span<double> buffer) const override {
    return inner().open_receive(from, tag, buffer);
  }
  std::unique_ptr<Round> open_round() const override { return inner().open_round(); }
  std::unique_ptr<Meeting> start_meeting() const override { return inner().start_meeting(); }

 protected:
  explicit Decorator(std::shared_ptr<const Communicator> inner)
      : Communicator(inner->properties()), inner_(std::move(inner)) {}
  const Communicator& inner() const { return *inner_; }

 private:
  std::shared_ptr<const Communicator> inner_;
};

}  // namespace talus::graph::detail
