#pragma once

/// A run made to follow a recorded one: every node of the loop begins in the order in which the recorded
/// nodes began, so that a schedule that went wrong once goes wrong again, under a debugger.

#include <atomic>
#include <cstdint>
#include <map>
#include <optional>
#include <stdexcept>
#include <vector>

#include "runtime/trace/trace.hpp"
#include "runtime/trace/traced.hpp"

namespace talus::trace {

/// The recorded order of one rank.
class Order {
 public:
  struct Turn {
    std::int32_t epoch;
    std::uint32_t node;
    bool operator==(const Turn&) const = default;
  };

  /// Keeps what it needs of the trace. Throws TraceError when a thread of it did not walk its nodes by
  /// (epoch, colour, index): another program, or a prediction with free threads.
  Order(const Trace& trace, int rank);

  int ranks() const { return ranks_; }
  int threads() const { return threads_; }
  /// Called by one thread before the loop of a step; true when the step was recorded.
  bool begin_step(std::uint32_t step);
  /// The plan of the loop in the run. Throws TraceError when it is not the recorded one: another scene,
  /// partition or number of threads.
  void check(const Plan& plan, std::uint32_t step) const;

  /// True when it is this node's turn, and the next one's from then on. Called by the thread that owns the
  /// node, until true. Throws TraceError when the recorded loop had ended by then.
  bool take(std::uint32_t node, int epoch) {
    // Relaxed: the order of beginnings is all it says; what nodes share is guarded by the loop itself.
    const std::size_t turn = turn_.load(std::memory_order_relaxed);
    if (turn >= current_->size())
      throw TraceError("the run goes on where the recorded loop had ended: its settings are others");
    if ((*current_)[turn] != Turn{epoch, node}) return false;
    turn_.store(turn + 1, std::memory_order_relaxed);  // only the one whose turn it is gets here
    return true;
  }

 private:
  int ranks_ = 1, threads_ = 1;
  std::vector<Plan> plans_;                           ///< of the rank, ascending steps
  std::map<std::uint32_t, std::vector<Turn>> turns_;  ///< per step
  const std::vector<Turn>* current_ = nullptr;
  std::atomic<std::size_t> turn_{0};  ///< written by the thread whose turn it is, read by all
};

/// One thread's view of a program of the epoch loop whose nodes wait for their turn.
template <NamedProgram Program>
class Ordered : public View<Program> {
 public:
  Ordered(Program& program, Order& order, const graph::Worker& me)
      : View<Program>(program), order_(order), me_(me) {}
  void node(std::uint32_t node, int epoch) {
    // What leaves no record has no turn. A run that was stopped elsewhere ends by itself.
    if (program_.kind(node, epoch) && !me_.wait([&] { return order_.take(node, epoch); })) return;
    program_.node(node, epoch);
  }

 private:
  using View<Program>::program_;
  Order& order_;
  const graph::Worker& me_;
};

}  // namespace talus::trace
