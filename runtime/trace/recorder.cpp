#include "runtime/trace/recorder.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace talus::trace {

Recorder::Recorder(RecorderOptions options) : options_(std::move(options)) {
  if (options_.threads < 1 || !options_.sink || options_.block == 0)
    throw std::invalid_argument("a recorder needs threads, a sink and room for records");
  lanes_.resize(static_cast<std::size_t>(options_.threads));
  for (std::size_t t = 0; t < lanes_.size(); ++t) {
    lanes_[t].owner_ = this;
    lanes_[t].thread_ = static_cast<std::int32_t>(t);
    lanes_[t].records_.reserve(options_.block + Lane::records_ahead);
  }
}

void Recorder::begin_step(std::uint32_t step) {
  step_ = std::min(step, largest_step);
  active_ = step >= options_.first_step && step <= options_.last_step;
  if (!active_) return;
  last_ = step_;
  if (pending_) plan(std::move(*std::exchange(pending_, std::nullopt)));
  if (left_ >= 0) lane(0).add(left_, now(), 0, -1, kind_outside);
}

void Recorder::end_step() {
  left_ = active_ ? now() : -1;
  ++step_;  // what follows is between two steps, and counts to the next
}

void Recorder::plan(Plan plan) {
  plan.rank = options_.rank;
  plan.step = step_;
  if (active_)
    options_.sink({options_.rank, 0, {}, std::move(plan)});
  else
    pending_ = std::move(plan);
}

void Recorder::finish() {
  for (Lane& lane : lanes_) {
    // Behind the last step, where results are written, say: between it and no other.
    while (!lane.records_.empty() && lane.records_.back().step() > last_) lane.records_.pop_back();
    hand_over(lane);
  }
}

void Recorder::hand_over(Lane& lane) {
  if (lane.records_.empty()) return;
  std::vector<Record> full;
  full.reserve(options_.block + Lane::records_ahead);
  std::swap(full, lane.records_);
  options_.sink({options_.rank, lane.thread_, std::move(full), std::nullopt});
}

}  // namespace talus::trace
