#include "runtime/trace/recorder.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace talus::trace {

Recorder::Recorder(RecorderOptions options) : options_(std::move(options)) {
  if (options_.threads < 1 || !options_.sink || options_.block == 0)
    throw std::invalid_argument("a recorder needs threads, a sink and room for records");
  tracks_.resize(static_cast<std::size_t>(options_.threads));
  for (std::size_t t = 0; t < tracks_.size(); ++t) {
    tracks_[t].owner_ = this;
    tracks_[t].thread_ = static_cast<std::int32_t>(t);
    tracks_[t].records_.reserve(options_.block + Track::records_ahead);
  }
}

void Recorder::begin_step(std::uint32_t step) {
  step_ = std::min(step, largest_step);
  active_ = step >= options_.first_step && step <= options_.last_step;
  if (!active_) return;
  last_ = step_;
  if (!std::exchange(declared_, true) && !tasks_.empty()) pass({options_.rank, 0, {}, std::nullopt, tasks_});
  if (pending_) plan(std::move(*std::exchange(pending_, std::nullopt)));
  if (left_ >= 0) track(0).add(left_, now(), 0, -1, kind_outside);
}

void Recorder::end_step() {
  left_ = active_ ? now() : -1;
  ++step_;  // what follows is between two steps, and counts to the next
  report_failure();
}

void Recorder::plan(Plan plan) {
  plan.rank = options_.rank;
  plan.step = step_;
  if (active_)
    pass({options_.rank, 0, {}, std::move(plan)});
  else
    pending_ = std::move(plan);
}

void Recorder::finish() {
  for (Track& track : tracks_) {
    // Behind the last step, where results are written, say: between it and no other.
    while (!track.records_.empty() && track.records_.back().step() > last_) track.records_.pop_back();
    hand_over(track);
  }
  report_failure();
}

void Recorder::hand_over(Track& track) {
  if (track.records_.empty()) return;
  std::vector<Record> full;
  full.reserve(options_.block + Track::records_ahead);
  std::swap(full, track.records_);
  pass({options_.rank, track.thread_, std::move(full), std::nullopt});
}

/// A full disk must not end the program in the destructor of a span.
void Recorder::pass(Block&& block) {
  {
    const std::lock_guard lock(mutex_);
    if (failed_) return;  // a file with a hole is no use
  }
  try {
    options_.sink(std::move(block));
  } catch (...) {
    const std::lock_guard lock(mutex_);
    if (!std::exchange(failed_, true)) failure_ = std::current_exception();
  }
}

void Recorder::report_failure() {
  const std::lock_guard lock(mutex_);
  if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
}

}  // namespace talus::trace
