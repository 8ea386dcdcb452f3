#include "runtime/graph/simulated_time.hpp"

#include "runtime/graph/detail/decorator.hpp"
#include "runtime/graph/detail/mpi_call.hpp"

namespace talus::graph {

#ifdef TALUS_SMPI

namespace {

using detail::MpiCall;

class TimedChannel final : public Channel {
 public:
  explicit TimedChannel(std::unique_ptr<Channel> inner) : inner_(std::move(inner)) {}
  void start() override {
    const MpiCall call;
    inner_->start();
  }
  bool done() override { return inner_->done(); }  // sends nothing, takes nothing (mpi_channel_smpi.cpp)
  double wait() override {
    if (inner_->done()) return 0;
    const MpiCall call(true);
    return inner_->wait();
  }

 private:
  std::unique_ptr<Channel> inner_;
};

class TimedRound final : public Round {
 public:
  explicit TimedRound(std::unique_ptr<Round> inner) : inner_(std::move(inner)) {}
  void begin(int to, std::span<const double> out, int from, std::span<double> in) override {
    const MpiCall call;
    inner_->begin(to, out, from, in);
  }
  void end() override {
    const MpiCall call(true);
    inner_->end();
  }

 private:
  std::unique_ptr<Round> inner_;
};

/// Simulated time passes between calls only, so each poll is a call of its own.
class TimedMeeting final : public Meeting {
 public:
  explicit TimedMeeting(std::unique_ptr<Meeting> inner) : inner_(std::move(inner)) {}
  bool complete() override {
    const MpiCall call;
    return inner_->complete();
  }

 private:
  std::unique_ptr<Meeting> inner_;
};

class SimulatedTime final : public detail::Decorator {
 public:
  explicit SimulatedTime(std::shared_ptr<const Communicator> inner) : Decorator(std::move(inner)) {}
  void exchange(std::span<const std::span<const std::byte>> to,
                const std::function<std::byte*(std::size_t, std::size_t)>& room) const override {
    const MpiCall call;
    inner().exchange(to, room);
  }
  void sum(std::span<std::int64_t> values) const override {
    if (values.empty()) return;  // no call
    const MpiCall call;
    inner().sum(values);
  }
  void max(std::span<double> values) const override {
    if (values.empty()) return;
    const MpiCall call;
    inner().max(values);
  }
  std::vector<std::byte> gather(std::span<const std::byte> part) const override {
    const MpiCall call;
    return inner().gather(part);
  }
  void to_first(std::span<const std::byte> part, std::size_t piece,
                const std::function<void(std::span<const std::byte>)>& take) const override {
    const MpiCall call;
    inner().to_first(part, piece, take);
  }
  std::unique_ptr<Channel> open_send(int to, int tag, std::span<double> buffer) const override {
    return std::make_unique<TimedChannel>(inner().open_send(to, tag, buffer));
  }
  std::unique_ptr<Channel> open_receive(int from, int tag, std::span<double> buffer) const override {
    return std::make_unique<TimedChannel>(inner().open_receive(from, tag, buffer));
  }
  std::unique_ptr<Round> open_round() const override {
    return std::make_unique<TimedRound>(inner().open_round());
  }
  std::unique_ptr<Meeting> start_meeting() const override {
    const MpiCall call;
    return std::make_unique<TimedMeeting>(inner().start_meeting());
  }
};

}  // namespace

std::unique_ptr<const Communicator> simulated_time(std::unique_ptr<const Communicator> inner) {
  return std::make_unique<SimulatedTime>(std::move(inner));
}

#else

std::unique_ptr<const Communicator> simulated_time(std::unique_ptr<const Communicator> inner) {
  return inner;
}

#endif

}  // namespace talus::graph
