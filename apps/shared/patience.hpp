#pragma once

/// Lines on stderr for work that takes long, and none for work that does not.

#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <string>

namespace talus {

/// Made when the work begins, asked as often as the work likes: the clock is read at each call (some 30 ns).
class Patience {
 public:
  using Clock = std::chrono::steady_clock;

  /// The first line comes after `first` at the earliest, and `between` two lies at least so much.
  explicit Patience(std::FILE* stream = stderr, Clock::duration first = std::chrono::seconds(1),
                    Clock::duration between = std::chrono::seconds(5))
      : stream_(stream), due_(Clock::now() + first), between_(between) {}

  /// Prints "talus: " and what `line()` gives, when a line is due.
  template <class Line>
  void tell(const Line& line) {
    const Clock::time_point now = Clock::now();
    if (now < due_) return;
    due_ = now + between_;
    const std::string text = fmt::format("talus: {}\n", line());
    std::fwrite(text.data(), 1, text.size(), stream_);  // fmt::print would throw where a log is full
    std::fflush(stream_);
  }

 private:
  std::FILE* stream_;
  Clock::time_point due_;
  Clock::duration between_;
};

}  // namespace talus
