#pragma once

#include "runtime/graph/communicator.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace talus {

struct RunOptions {
  std::string scene;                      ///< path of the scene file
  std::string out;                        ///< directory of the results; empty: the scene's
  bool force = false;                     ///< replace earlier results in `out`
  std::optional<std::int64_t> steps;      ///< stop after so many steps
  int threads = 0;                        ///< 0: as threads_for says
  std::vector<std::string> overrides;     ///< "a.b=c"
  std::string error_history;              ///< steps whose checks go to error_history.csv (StepList)
  std::vector<std::int64_t> dump_fclib;   ///< steps whose contact problem is dumped (fclib_dump)
  bool trace = false;                     ///< record the tasks into trace.h5
  std::string trace_steps;                ///< "first:last", recorded alone; empty: all
  bool trace_own_caches = false;          ///< trace::RecorderOptions::own_caches; of one rank and thread
  std::string replay_order;               ///< a trace whose order of tasks is to be followed; empty: none
  std::string task_times;                 ///< a trace by which tasks take their time; simulated ranks only
  bool resume = false;                    ///< go on from the last checkpoint in `out`, or begin
  std::string max_walltime;               ///< "3:50:00"; empty: none but that of the batch system
  bool quiet = false;                     ///< warnings and errors alone go to stderr
  bool dry_run = false;                   ///< read, build, place and check; write nothing
  std::vector<std::string> command_line;  ///< for run.json
};

/// `talus run`: from a scene file to a directory of results. Prints to stderr; returns an ExitCode.
int run_command(const RunOptions& options, const graph::Communicator& ranks);

}  // namespace talus
