#pragma once

/// Runs of the program that a scaling study starts.

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "apps/study_scaling/scaling_table.hpp"
#include "runtime/trace/replay.hpp"

namespace talus {

/// A machine: `ranks` processes of `threads` threads, and the subdomains they share.
struct ScalingMachine {
  int subdomains = 1, ranks = 1, threads = 1;
};

/// What is run: a scene file of the study with overrides.
struct ScalingSubject {
  ScalingKind kind = ScalingKind::strong;
  std::string scene;    ///< path of the scene file
  std::string variant;  ///< overrides with spaces between, or ""
  std::size_t grains = 0;
};

/// How programs are started.
struct ScalingLauncher {
  std::string talus;                ///< the program
  std::vector<std::string> mpirun;  ///< words before -n RANKS; empty: mpirun, a rank's threads on own cores
  std::filesystem::path work;  ///< beginning of the names of folders for what runs write, removed after each
  std::int64_t first = 1, last = 1;  ///< steps that count
};

/// The words that start a run whose results go to `out`.
std::vector<std::string> run_words(const ScalingLauncher& launcher, const ScalingSubject& subject,
                                   const ScalingMachine& machine, const std::string& out);

/// The steps that count of one run: means per step.
struct RunTimes {
  double seconds = 0, iterations = 0, contacts = 0;
  std::int64_t missed = 0;  ///< steps over tolerance
};

/// Reads steps.csv. Throws io::FileError when the file lacks one of the steps.
RunTimes read_times(const std::filesystem::path& steps_csv, std::int64_t first, std::int64_t last);

/// Runs once. Throws std::runtime_error with the end of the log when the run failed; one that missed its
/// tolerance has not.
RunTimes run_once(const ScalingLauncher& launcher, const ScalingSubject& subject,
                  const ScalingMachine& machine);

/// The same on one rank and thread with --trace; the trace is moved to `trace`. `own_caches`: of
/// trace::RecorderOptions; run times are longer then, times of tasks shorter.
RunTimes record_once(const ScalingLauncher& launcher, const ScalingSubject& subject, int subdomains,
                     bool own_caches, const std::filesystem::path& trace);

/// How simulated ranks are started: the program built for them (preset smpi) and SimGrid's launcher.
struct SimulatedLauncher {
  std::string talus, smpirun;
};

/// Runs on `machine.ranks` simulated ranks with one thread each and as many subdomains. Times are those of
/// the machine. Throws what run_once throws; std::invalid_argument for a machine that SimGrid does not have.
RunTimes simulate_once(const ScalingLauncher& launcher, const SimulatedLauncher& simulated,
                       const ScalingSubject& subject, const trace::Machine& machine);

/// A recording that a study keeps.
struct RecordedTrace {
  std::string file;   ///< name in the folder of traces
  std::string steps;  ///< that were recorded, "first:last"
  std::string variant;
  RunTimes times;
};

/// The list of recordings beside them, times.csv: file,variant,steps,seconds,iterations,contacts,missed.
/// Reading a list that is not there gives none. Throw io::FileError.
std::vector<RecordedTrace> read_recordings(const std::filesystem::path& times_csv);
void write_recordings(const std::filesystem::path& times_csv, const std::vector<RecordedTrace>& recorded);

/// Numbers of ranks that share `cores` with the same number of threads each, ascending: the divisors.
std::vector<int> rank_counts(int cores);

/// Median and range of the seconds, the most missed steps, medians of the rest, in the row of a machine.
ScalingRow row_of(const ScalingSubject& subject, const ScalingMachine& machine,
                  const std::vector<RunTimes>& times);

}  // namespace talus
