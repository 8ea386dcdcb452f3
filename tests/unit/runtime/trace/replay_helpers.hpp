#pragma once

/// Machines for tests of replay.

#include "runtime/trace/replay.hpp"

namespace talus::trace::test {

/// Nothing costs anything but what a test sets.
inline Machine bare(int ranks, int threads) {
  Machine machine;
  machine.ranks = ranks;
  machine.threads = threads;
  machine.latency = 0;
  machine.overhead = 0;
  machine.bandwidth = 1e30;
  machine.line = 0;
  machine.late_check = false;
  return machine;
}

inline double makespan(const Trace& trace, const Machine& machine) {
  return replay(Timeline(trace), machine, false).makespan;
}

}  // namespace talus::trace::test
