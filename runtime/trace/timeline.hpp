#pragma once

/// A step of a trace, by what ran instead of by when: which record is node 17 in epoch 4, and how long did it
/// work.

#include <cstdint>
#include <optional>
#include <unordered_map>
#include <vector>

#include "runtime/trace/trace.hpp"

namespace talus::trace {

/// Per track and record: its duration without that of the spans within it [ns]. Records must be sorted as
/// Track says. Cost: every record once.
std::vector<std::vector<float>> self_times(const Trace& trace);

/// Steps that hold tasks, ascending.
std::vector<std::uint32_t> steps_of(const Trace& trace);

/// From the record of a wait for a message to that of its send. Where a name is sent more than once in an
/// epoch the last wait has the last send before its end, the wait before that one of the sends before, and so
/// on: messages of a name come in their order, and not all are waited for. Waits without a send are left
/// out. Cost: a sort of all messages.
std::unordered_map<const Record*, const Record*> sends_of(const Trace& trace);

/// Where a record stands: trace.tracks[track].records[record].
struct Place {
  std::uint32_t track = 0xffffffffU, record = 0;
  bool exists() const { return track != 0xffffffffU; }
};

/// Collective calls.
struct Calls {
  int count = 0;
  double bytes = 0;  ///< that they add up
  void add(std::uint32_t of_one) {
    ++count;
    bytes += of_one;
  }
  /// Ranks call together, so the larger number of calls counts.
  void raise_to(const Calls& other) {
    if (other.count > count) *this = other;
  }
};

/// One step on all ranks.
struct StepIndex {
  struct Rank {
    const Plan* plan = nullptr;  ///< null when the step has no loop
    std::size_t nodes = 0;
    std::size_t epochs = 0;
    std::vector<Place> node;    ///< epochs x nodes; absent where a node did nothing
    std::vector<Place> check;   ///< per epoch; absent where nothing was decided
    std::vector<Place> task;    ///< per task of the step, absent for teams
    std::vector<Calls> calls;   ///< per task: collective calls within
    std::vector<int> awaited;   ///< per epoch: calls of all ranks in its check, outside of `whole`
    std::vector<char> settled;  ///< per epoch: its check reads its own sums on any number of ranks
    std::vector<std::vector<Place>> whole;  ///< per epoch: what all ranks did together within its check
    std::vector<Place> alone;               ///< per epoch: what the rank did for its own part there
    Place outside;                          ///< before the step; absent for the first of a trace
    Calls calls_outside;                    ///< collective calls within
    std::vector<Place> part;                ///< per task: a span within that is no wait, or absent

    Place at(std::size_t epoch, std::size_t n) const { return node[epoch * nodes + n]; }
  };
  std::uint32_t step = 0;
  std::vector<Rank> ranks;
};

/// The tree of ranks over which the step's loop glued walls.
graph::Tree tree_of(const StepIndex& index);

/// For all steps, one after the other; keeps what steps have in common.
class Timeline {
 public:
  /// Keeps the reference. Throws TraceError when there is no step.
  explicit Timeline(const Trace& trace);
  const Trace& trace() const { return trace_; }
  const std::vector<std::uint32_t>& steps() const { return steps_; }
  /// Throws TraceError when the step was recorded in part only.
  StepIndex index(std::uint32_t step) const;
  const Record& record(Place place) const { return trace_.tracks[place.track].records[place.record]; }
  /// [ns]; 0 where nothing was recorded.
  double self(Place place) const {
    return place.exists() ? static_cast<double>(self_[place.track][place.record]) : 0.0;
  }
  const std::vector<std::vector<float>>& self() const { return self_; }

 private:
  void add(const Track& track, std::uint32_t number, StepIndex& index) const;
  const Trace& trace_;
  std::vector<std::vector<float>> self_;
  std::vector<std::uint32_t> steps_;
};

}  // namespace talus::trace
