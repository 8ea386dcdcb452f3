#pragma once

#include "runtime/graph/communicator.hpp"
#include "runtime/trace/recorder.hpp"

namespace talus::trace {

/// Offset to be added to the clock of this rank's recorder, at `time`, to get that of rank 0. [ns]
struct ClockReading {
  double time = 0;
  double offset = 0;
};

/// Collective, by one thread of each rank. Rank 0 asks every other rank for its time repeatedly and uses the
/// fastest answer, assuming that the time was read half-way between question and answer (Cristian 1989).
/// Error: half the difference of the two ways of that one message, some 0.2 us in shared memory.
ClockReading read_clock(const graph::Communicator& ranks, const Recorder& recorder);

}  // namespace talus::trace
