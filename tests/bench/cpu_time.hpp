#pragma once

#include <time.h>

namespace talus::bench {

/// Processor time of the calling thread [s], which others on the machine do not lengthen by waiting.
inline double cpu_now() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

}  // namespace talus::bench
