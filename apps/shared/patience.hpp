#pragma once

/// Lines on stderr for work that takes long, and none for work that does not.

#include <fmt/format.h>

#include <chrono>
#include <cstdio>

namespace talus {

/// Made when the work begins, asked as often as the work likes: the clock is read at each call (some 30 ns).
class Patience {
 public:
  using Clock = std::chrono::steady_clock;

  /// The first line comes after `interval` at the earliest, and as much lies between two.
  explicit Patience(std::FILE* stream = stderr, Clock::duration interval = std::chrono::seconds(1))
      : stream_(stream), interval_(interval), last_(Clock::now()) {}

  /// Prints "talus: " and what `line()` gives, when a line is due.
  template <class Line>
  void tell(const Line& line) {
    const Clock::time_point now = Clock::now();
    if (now - last_ < interval_) return;
    last_ = now;
    fmt::print(stream_, "talus: {}\n", line());
    std::fflush(stream_);
  }

 private:
  std::FILE* stream_;
  Clock::duration interval_;
  Clock::time_point last_;
};

}  // namespace talus
