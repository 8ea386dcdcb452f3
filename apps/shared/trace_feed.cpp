#include "apps/shared/trace_feed.hpp"

#include <fmt/format.h>

#include <charconv>
#include <stdexcept>
#include <utility>

#include "runtime/step/task_kinds.hpp"
#include "runtime/trace/clock.hpp"

namespace talus {

StepRange parse_steps(const std::string& text, const std::string& option) {
  const auto number = [&](std::string_view part, std::uint32_t otherwise) {
    if (part.empty()) return otherwise;
    std::uint32_t value = 0;
    const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), value);
    if (error != std::errc{} || end != part.data() + part.size())
      throw std::invalid_argument(fmt::format("{} wants FIRST:LAST, e.g. 100:120, not '{}'", option, text));
    return value;
  };
  const std::string_view view = text;
  if (text.empty()) return {};
  const std::size_t colon = view.find(':');
  StepRange range;
  range.first = number(view.substr(0, colon), range.first);
  range.last = colon == std::string_view::npos ? range.first : number(view.substr(colon + 1), range.last);
  if (range.first < 1 || range.last < range.first || range.last > trace::largest_step)
    throw std::invalid_argument(
        fmt::format("{} {}: steps count from 1, the first comes before the last", option, text));
  return range;
}

TraceFeed::TraceFeed(const std::string& directory, StepRange steps, bool own_caches, int threads,
                     const graph::Communicator& ranks)
    : directory_(directory),
      ranks_(ranks),
      recorder_({.rank = ranks.rank(),
                 .threads = threads,
                 .first_step = steps.first,
                 .last_step = steps.last,
                 .own_caches = own_caches,
                 .sink =
                     [this](trace::Block&& block) {
                       executor_->submit_background(
                           "output of the trace", [this, kept = std::move(block)] { writer_.append(kept); });
                     }}),
      writer_(io::trace_file_of(directory, ranks.rank()), ranks.ranks(), threads, false, task_kinds()) {
  clock_.rank = ranks.rank();
}

TraceFeed::~TraceFeed() {
  ranks_.record_to(nullptr);
}

void TraceFeed::start(graph::Executor& executor) {
  executor_ = &executor;
  const trace::ClockReading reading = trace::read_clock(ranks_, recorder_);
  clock_.offsets[0] = {reading.time, reading.offset};
  ranks_.record_to(&recorder_);
}

void TraceFeed::finish(graph::Executor& executor) {
  ranks_.record_to(nullptr);
  const trace::ClockReading reading = trace::read_clock(ranks_, recorder_);
  clock_.offsets[1] = {reading.time, reading.offset};
  recorder_.finish();
  executor.drain();
  writer_.append(clock_);
  double written[1] = {1};
  ranks_.max(written);  // every rank's file is whole
  if (ranks_.rank() != 0) return;
  for (int rank = 1; rank < ranks_.ranks(); ++rank) {
    const std::filesystem::path part = io::trace_file_of(directory_, rank);
    writer_.append_file(part);
    std::filesystem::remove(part);
  }
}

}  // namespace talus
