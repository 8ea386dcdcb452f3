#pragma once

/// Predicts a recorded run on another machine: every task takes its recorded time, dependencies follow from
/// the plan, and messages between ranks are modelled (docs/theory.md, "Replay").

#include <cstdint>
#include <vector>

#include "runtime/trace/machine.hpp"
#include "runtime/trace/timeline.hpp"

namespace talus::trace {

/// The subdomains of a trace, in order; one without cuts.
std::vector<std::uint32_t> groups_of(const Trace& trace);

struct Replay {
  Trace trace;          ///< predicted, or of the recorded machine as replayed; empty if not kept
  double makespan = 0;  ///< [ns]
  double work = 0;      ///< of all tasks, without waiting [ns]
  std::size_t tasks = 0;
  double dispatch = 0;  ///< between two nodes of a thread that need not wait, not within them [ns]
};

/// Plays all steps of a trace. `keep`: whether to keep the predicted records, for pictures and shares of
/// time. Throws TraceError when steps were recorded in part, or the trace has no order that can be played.
/// Cost (bench_trace): 0.2-0.5 us a task; memory: the trace itself once more if kept.
Replay replay(const Timeline& timeline, const Machine& machine, bool keep);

}  // namespace talus::trace
