#include "apps/commands/recorder_feed.hpp"

#include <algorithm>
#include <utility>

namespace talus {

RecorderFeed::RecorderFeed(graph::Executor& executor, io::Recorder& recorder,
                           const graph::Communicator& ranks, StepList error_steps)
    : executor_(executor), recorder_(recorder), ranks_(ranks), error_steps_(std::move(error_steps)) {}

void RecorderFeed::row(const Simulation& simulation) {
  const std::optional<TriaxialReport> triaxial = simulation.triaxial();
  const std::optional<CellReport> cell = simulation.cell();
  if (ranks_.rank() != 0) return;
  std::vector<WallReport> walls = simulation.walls();
  for (WallReport& group : simulation.groups()) walls.push_back(std::move(group));
  rows_.push_back({.step = simulation.report(),
                   .walls = std::move(walls),
                   .triaxial = triaxial,
                   .bodies = simulation.named_bodies(),
                   .inserted = simulation.inserted(),
                   .removed = simulation.removed(),
                   .probes = simulation.probes(),
                   .cell = cell});
  if (error_steps_.contains(simulation.report().step)) rows_.back().errors = simulation.error_history();
  if (rows_.size() >= 64 || graph::seconds_now() - flushed_ > 0.5) flush();
}

void RecorderFeed::frame(Frame&& frame) {
  flush();
  if (ranks_.ranks() > 1) {
    executor_.drain();
    record(std::move(frame));
    return;
  }
  executor_.submit_background("output of a frame",
                              [this, moved = std::move(frame)]() mutable { record(std::move(moved)); });
}

void RecorderFeed::record(Frame&& frame) {
  const double began = graph::seconds_now();
  recorder_.record_frame(std::move(frame));
  frame_seconds_.store(std::max(frame_seconds(), graph::seconds_now() - began), std::memory_order_relaxed);
}

void RecorderFeed::later(const char* name, std::function<void()> work) {
  flush();
  executor_.submit_background(name, std::move(work));
}

void RecorderFeed::flush() {
  flushed_ = graph::seconds_now();
  if (rows_.empty()) return;
  executor_.submit_background("output of steps", [this, rows = std::move(rows_)] {
    for (const io::StepRecord& row : rows) recorder_.record_step(row);
    recorder_.flush();
  });
  rows_.clear();
}

}  // namespace talus
