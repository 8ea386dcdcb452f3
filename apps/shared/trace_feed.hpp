#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "io/trace/trace_file.hpp"
#include "runtime/graph/communicator.hpp"
#include "runtime/graph/executor.hpp"
#include "runtime/trace/recorder.hpp"

namespace talus {

/// The steps that an option like `--trace-steps a:b` names, both included; either may be left out. Throws
/// std::invalid_argument with the name of the option and the remedy for anything else.
struct StepRange {
  std::uint32_t first = 1, last = trace::largest_step;
};
StepRange parse_steps(const std::string& text, const std::string& option = "--trace-steps");

/// The way of a trace from the recorder to DIR/trace.h5: full buffers are written on the executor's
/// background thread. Each rank writes a file of its own, which rank 0 puts together in the end.
///
///     TraceFeed feed(directory, steps, false, threads, ranks);
///     Executor executor({.threads = threads, .trace = &feed.recorder()});
///     feed.start(executor);
///     ... steps ...
///     feed.finish(executor);
class TraceFeed {
 public:
  /// `own_caches`: RecorderOptions has it.
  TraceFeed(const std::string& directory, StepRange steps, bool own_caches, int threads,
            const graph::Communicator& ranks);
  ~TraceFeed();
  TraceFeed(const TraceFeed&) = delete;
  TraceFeed& operator=(const TraceFeed&) = delete;
  trace::Recorder& recorder() { return recorder_; }
  /// Collective. Before the first step.
  void start(graph::Executor& executor);
  /// Collective. Everything is in trace.h5 then. Throws io::FileError or graph::TaskError.
  void finish(graph::Executor& executor);

 private:
  const std::filesystem::path directory_;
  const graph::Communicator& ranks_;
  graph::Executor* executor_ = nullptr;
  trace::Recorder recorder_;
  io::TraceWriter writer_;
  io::RankClock clock_;
};

}  // namespace talus
