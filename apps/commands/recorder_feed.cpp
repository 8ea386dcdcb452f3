#include "apps/commands/recorder_feed.hpp"

#include <algorithm>
#include <cstdint>
#include <utility>

namespace talus {

namespace {

/// Frames of more bytes are written before the run goes on, lest they stand beside what iterations need: on
/// one rank that is 300 bytes a grain beside 250.
constexpr std::size_t largest_kept = std::size_t{1} << 26;

std::size_t bytes_of(const Frame& frame) {
  constexpr std::size_t body = sizeof(std::int64_t) + sizeof(double) + 2 * sizeof(Vec3);
  constexpr std::size_t contact = 2 * sizeof(std::int64_t) + sizeof(double) + 3 * sizeof(Vec3);
  return body * frame.id.size() + contact * frame.contact_bodies.size();
}

}  // namespace

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
  const bool waits = bytes_of(frame) > largest_kept;
  executor_.submit_background("output of a frame",
                              [this, moved = std::move(frame)]() mutable { record(std::move(moved)); });
  if (waits) executor_.drain();
}

void RecorderFeed::record(Frame&& frame) {
  // The clock of a simulated rank can be read by its own thread only.
  if (graph::simulated_ranks) return recorder_.record_frame(std::move(frame));
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
