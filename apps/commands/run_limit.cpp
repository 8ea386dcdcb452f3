#include "apps/commands/run_limit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cstdlib>
#include <stdexcept>
#include <vector>

namespace talus {

namespace {

/// What closing files takes, and the launcher [s].
constexpr double ending = 1;
/// A step that was long counts less and less, so that one of a busy machine does not end the run hours later.
constexpr double forgets = 0.99;

}  // namespace

double parse_duration(const std::string& text) {
  const auto refuse = [&] {
    throw std::invalid_argument(
        fmt::format("'{}' is no time; write hours:minutes:seconds, such as 3:50:00", text));
  };
  std::string rest = text;
  double days = 0;
  const auto number = [&](const std::string& word) {
    unsigned value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (word.empty() || error != std::errc{} || end != word.data() + word.size()) refuse();
    return static_cast<double>(value);
  };
  if (const std::size_t dash = rest.find('-'); dash != std::string::npos) {
    days = number(rest.substr(0, dash));
    rest.erase(0, dash + 1);
  }
  std::vector<double> parts;
  for (std::size_t colon; (colon = rest.find(':')) != std::string::npos; rest.erase(0, colon + 1))
    parts.push_back(number(rest.substr(0, colon)));
  parts.push_back(number(rest));
  if (parts.size() < 2 || parts.size() > 3 || (days > 0 && parts.size() != 3)) refuse();
  double seconds = 24 * days;
  if (parts.size() == 2) parts.insert(parts.begin(), 0);
  seconds += parts[0];
  for (const std::size_t k : {1U, 2U}) {
    // 90:00 is an hour and a half, 0:99 a minute and some; 1:99 is neither.
    if (parts[k] >= 60 && seconds > 0) refuse();
    seconds = 60 * seconds + parts[k];
  }
  if (seconds == 0) refuse();
  return seconds;
}

std::optional<double> time_granted(std::optional<double> given) {
  std::optional<double> granted = given;
  if (const char* end = std::getenv("SLURM_JOB_END_TIME")) {
    const double now =
        std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
    const double left = std::strtod(end, nullptr) - now;
    granted = std::min(left, given.value_or(left));
  }
  return granted;
}

void WallLimit::took_step(double seconds) {
  step_ = std::max(seconds, forgets * step_);
}

void WallLimit::took_save(double seconds) {
  save_ = std::max(seconds, save_);
}

void WallLimit::took_frame(double seconds) {
  frame_ = std::max(seconds, frame_);
}

bool WallLimit::reached(double now) const {
  const double save = save_ > 0 ? save_ : frame_;
  return end_ && now + 2 * (step_ + frame_ + save) + ending > *end_;
}

}  // namespace talus
