#include "runtime/trace/clock.hpp"

#include <limits>
#include <vector>

namespace talus::trace {
namespace {

constexpr int tag = 0;  ///< below those of the gluing
constexpr int rounds = 32;

/// Two numbers each way.
struct Line {
  Line(const graph::Communicator& ranks, int other)
      : sender(ranks.open_send(other, tag, out)), receiver(ranks.open_receive(other, tag, in)) {}
  void send(double first, double second) {
    sender->wait();
    out[0] = first;
    out[1] = second;
    sender->start();
  }
  void receive() {
    receiver->start();
    receiver->wait();
  }
  std::vector<double> out = std::vector<double>(2), in = std::vector<double>(2);
  std::unique_ptr<graph::Channel> sender, receiver;
};

}  // namespace

ClockReading read_clock(const graph::Communicator& ranks, const Recorder& recorder) {
  const auto now = [&] { return static_cast<double>(recorder.now()); };
  if (ranks.rank() != 0) {
    Line line(ranks, 0);
    for (int round = 0; round < rounds; ++round) {
      line.receive();
      line.send(now(), 0);
    }
    line.receive();
    line.sender->wait();
    return {line.in[0], line.in[1]};
  }
  for (int other = 1; other < ranks.ranks(); ++other) {
    Line line(ranks, other);
    double shortest = std::numeric_limits<double>::infinity();
    ClockReading best;
    for (int round = 0; round < rounds; ++round) {
      const double asked = now();
      line.send(asked, 0);
      line.receive();
      const double took = now() - asked;
      if (took >= shortest) continue;
      shortest = took;
      best = {line.in[0], asked + took / 2 - line.in[0]};
    }
    line.send(best.time, best.offset);
    line.sender->wait();
  }
  return {now(), 0};
}

}  // namespace talus::trace
