#pragma once

/// A run made to follow a recorded one: every node of the loop begins in the order in which the recorded
/// nodes began, so that a fault that depends on the schedule can be repeated under a debugger.

#include <atomic>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "runtime/trace/trace.hpp"
#include "runtime/trace/traced.hpp"

namespace talus::trace {

/// The recorded order of one rank.
class Order {
 public:
  /// A node in an epoch.
  struct Visit {
    std::int32_t epoch;
    std::uint32_t node;
    bool operator==(const Visit&) const = default;
  };

  /// Keeps what it needs of the trace. Throws TraceError when a thread of it did not walk its nodes by
  /// (epoch, colour, index): another program, or a prediction with free threads.
  Order(const Trace& trace, int rank);

  int ranks() const { return ranks_; }
  int threads() const { return threads_; }
  /// The run's loop from now on. Called by one thread between loops.
  void plan(Plan plan) { plan_ = std::move(plan); }
  /// Called by one thread before the loop of a step; true when the step was recorded. Throws TraceError when
  /// its loop is not the recorded one: another scene, partition or number of threads.
  bool begin_step(std::uint32_t step);

  /// The place in the recorded order of the `done`-th node of a thread in this step. Called for each node
  /// that the thread comes to; none when the node does nothing, neither in the run (`works`) nor in the
  /// recording. Throws TraceError where the two differ: other nodes would wait for ever for that place.
  std::optional<std::size_t> place(int thread, std::size_t done, Visit visit, bool works) const;
  /// Throws TraceError when the run decides after an epoch and the recording did not: its order may mix nodes
  /// of before and after the decision.
  void check_gate(int epoch) const;
  /// True when all earlier places have begun; the next place may begin from then on. Called by one thread,
  /// until true.
  bool take(std::size_t place) {
    // Relaxed: the order of beginnings is all it says; what nodes share is guarded by the loop itself.
    if (next_.load(std::memory_order_relaxed) != place) return false;
    next_.store(place + 1, std::memory_order_relaxed);
    return true;
  }

 private:
  /// A node of a thread, and its place among those of all.
  struct Placed {
    Visit visit;
    std::size_t place;
  };
  struct Step {
    const Plan* plan = nullptr;
    std::vector<std::vector<Placed>> threads;
    std::set<std::int32_t> gates;  ///< epochs behind which something was decided
  };

  int ranks_ = 1, threads_ = 1;
  std::vector<Plan> plans_;              ///< of the rank, ascending steps
  std::map<std::uint32_t, Step> steps_;  ///< by number
  std::optional<Plan> plan_;             ///< the run's
  std::uint32_t number_ = 0;             ///< of the step
  const Step* current_ = nullptr;
  std::atomic<std::size_t> next_{0};  ///< written by the thread that is to go on, read by all
};

/// One thread's view of a program of the epoch loop whose nodes wait for their place in the recorded order.
template <NamedProgram Program>
class Ordered : public View<Program> {
 public:
  Ordered(Program& program, Order& order, const graph::Worker& me)
      : View<Program>(program), order_(order), me_(me) {}
  void node(std::uint32_t node, int epoch) {
    // A node that leaves no record has no place in the order.
    const bool works = program_.kind(node, epoch).has_value();
    if (const auto place = order_.place(me_.thread(), done_, {epoch, node}, works)) {
      // A run that was stopped elsewhere ends by itself.
      if (!me_.wait([&] { return order_.take(*place); })) return;
      ++done_;
    }
    program_.node(node, epoch);
  }
  bool gate(int epoch) {
    const bool decides = program_.gate(epoch);
    if (decides) order_.check_gate(epoch);
    return decides;
  }

 private:
  using View<Program>::program_;
  Order& order_;
  const graph::Worker& me_;
  std::size_t done_ = 0;  ///< nodes that were visited
};

}  // namespace talus::trace
