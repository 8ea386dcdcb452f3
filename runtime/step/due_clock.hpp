#pragma once

/// When the next frame, checkpoint or report of a probe is due, by steps and by simulated time: the same on
/// all ranks.

#include <cstdint>
#include <optional>

namespace talus {

class DueClock {
 public:
  /// `every_steps` >= 1; `every` > 0 [s]; `passed`: multiples of `every` that have passed.
  DueClock(std::optional<std::int64_t> every_steps, std::optional<double> every, std::int64_t passed = 0)
      : every_steps_(every_steps), every_(every), passed_(passed) {}

  /// To be asked after every step, with its number and the time [s] at its end.
  bool due(std::int64_t step, double time) {
    bool now = every_steps_ && step % *every_steps_ == 0;
    if (every_) {
      // Rounding in a sum of time steps must not delay what is due exactly at the end of one.
      const auto passed = static_cast<std::int64_t>(time / *every_ * (1 + 1e-12));
      now |= passed > passed_;
      passed_ = passed;
    }
    return now;
  }
  std::int64_t passed() const { return passed_; }

 private:
  std::optional<std::int64_t> every_steps_;
  std::optional<double> every_;
  std::int64_t passed_;
};

}  // namespace talus
