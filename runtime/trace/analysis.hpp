#pragma once

/// Analyses where the time of a trace went. Recorded and predicted traces are treated alike.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "runtime/trace/timeline.hpp"

namespace talus::trace {

/// All tasks of one name: a kind, by what it does within.
struct KindSummary {
  std::size_t count = 0;
  double self = 0;                            ///< [ns]
  double longest = 0;                         ///< [ns]
  std::array<std::uint32_t, 32> histogram{};  ///< of durations, in powers of 2 ns
};

/// Share of the critical path that was spent in tasks of one kind, or in waits.
struct PathShare {
  std::string what;
  double time = 0;  ///< [ns]
  std::size_t count = 0;
};

/// Efficiencies as in the POP project (www.pop-coe.eu), from the times t of useful work, their mean per rank
/// U_r, and the time e_r that a rank's threads waited for messages on average; T the makespan, r* the rank
/// with the most work. parallel = mean t / T = load_balance x communication x threads.
struct Efficiencies {
  double load_balance = 1;   ///< mean U_r / max U_r
  double communication = 1;  ///< 1 - e_r* / T
  double threads = 1;        ///< U_r* / (T - e_r*): waiting within a rank, serial parts
  double parallel = 1;
};

struct Summary {
  bool predicted = false;
  int ranks = 1, threads = 1;
  std::size_t steps = 0, records = 0;
  double makespan = 0;  ///< from the first begin to the last end [ns]
  double work = 0;      ///< of tasks, summed over threads [ns]
  double exposed = 0;   ///< waited for messages, collective calls included [ns]
  double idle = 0;      ///< neither work nor waiting for messages [ns]
  std::array<double, phase_count>
      phase{};                     ///< self times; messages waited for count as exchange inside the loop
  double imbalance = 0;            ///< most work of a rank over the mean, less 1
  std::vector<std::string> names;  ///< of kinds
  std::vector<KindSummary> kinds;  ///< per kind
  Efficiencies efficiency;
  std::vector<PathShare> path;  ///< of the critical path, longest first
  double path_time = 0;         ///< [ns]
  std::size_t messages = 0;     ///< between ranks
};

/// Cost: about 0.3 us a record. Throws TraceError when steps were recorded in part.
Summary analyse(const Trace& trace);
Summary analyse(const Timeline& timeline);

/// The summary as a table for people.
std::string describe(const Summary& summary);

/// A record on the critical path, and when it was: from when it had all it waited for, until the next on the
/// path could go on. [ns]
struct PathHop {
  Place place;
  double from = 0, until = 0;
};

/// The critical path, followed backwards from the last record: each record could go on when the one before it
/// on the path had ended, or its message had come. It is followed step by step, since all ranks meet at the
/// end of a step.
std::vector<PathHop> critical_path(const Timeline& timeline, const StepIndex& index);

}  // namespace talus::trace
