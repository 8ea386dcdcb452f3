#pragma once

/// Recorded durations of tasks, for a run on simulated ranks: its host switches between ranks at every
/// message, and its own times would be those of cold caches. With given times a run and a replay of the same
/// recording differ in their models of the machine only.

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "runtime/graph/clock.hpp"
#include "runtime/trace/trace.hpp"
#include "runtime/trace/traced.hpp"

namespace talus::trace {

/// Of one rank, in the steps that were recorded.
class TaskTimes {
 public:
  /// Lays the recording out on `ranks` ranks of one thread as replay does, every task with its median
  /// (Machine::quantile 0.5), and keeps those of `rank`. Throws like replay, TraceError or
  /// std::invalid_argument.
  TaskTimes(const Trace& recorded, int ranks, int rank);

  /// True when the step was recorded: its times are given until end_step.
  bool begin_step(std::uint32_t step);
  void end_step() { current_ = nullptr; }
  bool active() const { return current_ != nullptr; }
  /// Throws TraceError unless the run has the recorded tasks: another scene or other subdomains.
  void check(const std::vector<Task>& tasks) const;
  /// The run's loop from now on, whose nodes may stand in another order.
  void plan(const Plan& plan);

  // Of the present step [s], without waits for other ranks.
  double task(std::uint32_t id) const;
  /// Throw TraceError when the recorded loop was another one, or had no such node in this epoch, or no
  /// decision.
  double node(std::uint32_t node, int epoch) const;
  double decision(int epoch) const;

 private:
  struct Step {
    Plan plan;
    std::vector<double> task;
    std::vector<std::vector<double>> node;  ///< per epoch; < 0: did nothing
    std::vector<double> decision;           ///< per epoch; < 0: none
  };

  void match();

  std::vector<Task> tasks_;
  std::map<std::uint32_t, Step> steps_;
  const Step* current_ = nullptr;
  Plan plan_;                         ///< the run's
  std::vector<std::uint32_t> place_;  ///< per node of the run: the recorded one; empty: loops differ
};

/// A program of the epoch loop whose nodes and decisions take their given times.
template <NamedProgram Program>
class Timed : public View<Program> {
 public:
  Timed(Program& program, const TaskTimes& times) : View<Program>(program), times_(times) {}
  void node(std::uint32_t node, int epoch) {
    const graph::GivenTime given(program_.kind(node, epoch) ? times_.node(node, epoch) : 0);
    program_.node(node, epoch);
  }
  bool decide(int epoch) {
    const graph::GivenTime given(times_.decision(epoch));
    return program_.decide(epoch);
  }

 private:
  using View<Program>::program_;
  const TaskTimes& times_;
};

}  // namespace talus::trace
