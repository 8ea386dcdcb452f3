#pragma once

#include "runtime/graph/communicator.hpp"
#include "runtime/trace/recorder.hpp"

namespace talus::trace {

/// What must be added to the clock of this rank's recorder, at `time`, for that of rank 0. [ns]
struct ClockReading {
  double time = 0;
  double offset = 0;
};

/// Collective, by one thread of each rank. Rank 0 asks every other rank for its time, again and again; of the
/// answers the fastest counts, taken to be half-way old (Cristian 1989). Error: half the difference of the
/// two ways of that one message, some 0.2 us in shared memory.
ClockReading read_clock(const graph::Communicator& ranks, const Recorder& recorder);

}  // namespace talus::trace
