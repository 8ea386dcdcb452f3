#include "runtime/graph/delayed_messages.hpp"

#include <algorithm>

#include "runtime/graph/clock.hpp"

namespace talus::graph {

namespace {

/// A channel whose message carries the time of sending behind its data.
class Stamped : public Channel {
 protected:
  explicit Stamped(std::span<double> buffer) : buffer_(buffer), stamped_(buffer.size() + 1) {}
  std::span<double> buffer_;
  std::vector<double> stamped_;
  std::unique_ptr<Channel> inner_;
};

class DelayedSender final : public Stamped {
 public:
  DelayedSender(const Communicator& ranks, int to, int tag, std::span<double> buffer) : Stamped(buffer) {
    inner_ = ranks.open_send(to, tag, stamped_);
  }
  void start() override {
    std::copy(buffer_.begin(), buffer_.end(), stamped_.begin());
    stamped_.back() = seconds_now();
    inner_->start();
  }
  bool done() override { return inner_->done(); }
};

class DelayedReceiver final : public Stamped {
 public:
  DelayedReceiver(const Communicator& ranks, int from, int tag, std::span<double> buffer, double delay)
      : Stamped(buffer), delay_(delay) {
    inner_ = ranks.open_receive(from, tag, stamped_);
  }
  void start() override {
    inner_->start();
    open_ = true;
  }
  bool done() override {
    if (!open_) return true;
    if (!inner_->done() || seconds_now() < stamped_.back() + delay_) return false;
    std::copy_n(stamped_.begin(), buffer_.size(), buffer_.begin());
    open_ = false;
    return true;
  }

 private:
  double delay_;
  bool open_ = false;  ///< started and not yet handed on
};

}  // namespace

std::unique_ptr<Channel> DelayedMessages::open_send(int to, int tag, std::span<double> buffer) const {
  return std::make_unique<DelayedSender>(inner(), to, tag, buffer);
}

std::unique_ptr<Channel> DelayedMessages::open_receive(int from, int tag, std::span<double> buffer) const {
  return std::make_unique<DelayedReceiver>(inner(), from, tag, buffer, delay_);
}

}  // namespace talus::graph
