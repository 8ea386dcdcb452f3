#pragma once

/// The clock of a recorder.

#include <chrono>
#include <cstdint>

#include "runtime/graph/clock.hpp"

namespace talus::trace {

/// Time since it was made. Where the system takes its own time from the processor's counter (which it does
/// when that is the same on all cores and never changes its pace), the counter is read as it is. The system's
/// clock waits for all earlier instructions, so that the loads of a task could not begin before the last sums
/// of the task before had been completed: with tasks of 2 us that was half of the cost of a trace.
class Ticks {
 public:
  /// Takes a millisecond to measure a tick, to 1e-4 of it or better.
  Ticks();
  /// [ns]
  std::int64_t now() const {
#ifdef __x86_64__
    if (length_ > 0) return static_cast<std::int64_t>(static_cast<double>(count() - first_) * length_);
#endif
    return std::chrono::duration_cast<std::chrono::nanoseconds>(graph::Clock::now() - start_).count();
  }

 private:
#ifdef __x86_64__
  static std::int64_t count() {
    return static_cast<std::int64_t>(__builtin_ia32_rdtsc());
  }
  std::int64_t first_ = 0;
  double length_ = 0;  ///< of a tick [ns]; 0: the counter is not to be used
#endif
  graph::Clock::time_point start_ = graph::Clock::now();
};

}  // namespace talus::trace
