#pragma once

#include <optional>
#include <string>

#include "runtime/trace/replay.hpp"

namespace talus {

struct ReplayOptions {
  std::string file;                    ///< a trace
  std::optional<int> ranks, threads;   ///< empty: as recorded
  std::optional<int> ranks_per_node;   ///< empty: 1, or all on the recorded machine
  std::optional<double> node_latency;  ///< [s]; empty: as measured in the trace, if it has messages
  std::string map;                     ///< of subdomains to ranks; empty: as recorded
  std::string schedule = "fixed";
  trace::Machine machine;       ///< all that has a number
  std::optional<double> steps;  ///< extrapolate to so many steps
  bool blocking_check = false;
  std::string smpi_platform;  ///< write the machine for smpirun; empty: nothing
  std::string out;            ///< write what would have been as a trace; empty: nothing
  bool force = false;         ///< replace files that are there
};

/// `talus replay`: a recorded run on a machine that is not there. Prints what it would take, and what bounds
/// it; returns an ExitCode.
int replay_command(ReplayOptions options);

}  // namespace talus
