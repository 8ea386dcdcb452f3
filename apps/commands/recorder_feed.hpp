#pragma once

#include <atomic>
#include <functional>
#include <optional>
#include <vector>

#include "apps/commands/step_list.hpp"
#include "io/output/recorder.hpp"
#include "runtime/graph/clock.hpp"
#include "runtime/graph/communicator.hpp"
#include "runtime/graph/executor.hpp"
#include "runtime/step/simulation.hpp"

namespace talus {

/// Rows of finished steps on their way to the recorder, which runs on the executor's background thread. Rows
/// go in batches, since a row is less work than handing it over. A run waits for large frames. Frames of
/// several ranks are written by all of them together, between two steps: messages of a background thread
/// would need an order among those of the steps. What a write throws comes out of the executor.
class RecorderFeed {
 public:
  /// All three must outlive it. The rows of `error_steps` have the errors of every check.
  RecorderFeed(graph::Executor& executor, io::Recorder& recorder, const graph::Communicator& ranks,
               StepList error_steps);

  /// Rank 0 alone has rows.
  void row(const Simulation& simulation);

  /// Collective.
  void frame(Frame&& frame);

  /// Anything that writes files: one thread at a time may be inside HDF5. `name` is for the trace.
  void later(const char* name, std::function<void()> work);

  /// That the longest output of a frame so far has taken [s].
  double frame_seconds() const { return frame_seconds_.load(std::memory_order_relaxed); }

  void flush();
  /// The same, and waits until all of it is with the recorder. Throws what a write has thrown.
  void drain() {
    flush();
    executor_.drain();
  }

 private:
  void record(Frame&& frame);

  graph::Executor& executor_;
  io::Recorder& recorder_;
  const graph::Communicator& ranks_;
  StepList error_steps_;
  std::vector<io::StepRecord> rows_;
  double flushed_ = graph::seconds_now();
  /// Written by the thread that records frames, read between steps. Relaxed: a number that comes a step late
  /// makes an estimate late, and nothing hangs on it.
  std::atomic<double> frame_seconds_ = 0;
};

}  // namespace talus
