#pragma once

/// A slow network on one machine, for tests and benchmarks.

#include "runtime/graph/detail/decorator.hpp"

namespace talus::graph {

/// Every message of a channel is held back until `delay` [s] after it was sent; collective calls are not
/// delayed. The time of sending travels behind the message, so ranks must share a clock, as those of one
/// machine do. Each side copies the message once more.
class DelayedMessages final : public detail::Decorator {
 public:
  DelayedMessages(std::shared_ptr<const Communicator> inner, double delay)
      : Decorator(std::move(inner)), delay_(delay) {}
  std::unique_ptr<Channel> open_send(int to, int tag, std::span<double> buffer) const override;
  std::unique_ptr<Channel> open_receive(int from, int tag, std::span<double> buffer) const override;

 private:
  double delay_;
};

}  // namespace talus::graph
