#pragma once

#include <time.h>

#include <chrono>

namespace talus::bench {

/// Processor time of the calling thread [s], which others on the machine do not lengthen by waiting.
inline double cpu_now() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// Time on the wall [s], from no point in particular: of what several threads do.
inline double wall_now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace talus::bench
