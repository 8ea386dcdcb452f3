#include "apps/study_scaling/scaling_runs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "apps/shared/child_process.hpp"
#include "apps/shared/exit_codes.hpp"
#include "apps/shared/median.hpp"
#include "io/files/csv_table.hpp"
#include "io/files/error.hpp"
#include "io/files/output_directory.hpp"
#include "io/trace/smpi_platform.hpp"

namespace talus {

namespace {

namespace fs = std::filesystem;

RunTimes start(const ScalingLauncher& launcher, const std::vector<std::string>& words,
               const fs::path& folder) {
  const fs::path log = folder / "log";
  const int code = run_child(words, log);
  if (code != exit_done && code != exit_tolerance_missed)
    throw std::runtime_error(fmt::format("exit code {} of {}{}", code, shell_line(words), tail_of(log)));
  return read_times(folder / "out" / "steps.csv", launcher.first, launcher.last);
}

/// Of a line that io::CsvTable wrote: names with commas or quotes are between quotes, quotes within twice.
std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells(1);
  bool within = false, closed = false;
  for (const char c : line) {
    if (c == '"') {
      if (closed) cells.back() += c;  // the second of two
      within = !within;
      closed = !within;
      continue;
    }
    closed = false;
    if (c == ',' && !within)
      cells.emplace_back();
    else
      cells.back() += c;
  }
  return cells;
}

}  // namespace

std::vector<std::string> run_words(const ScalingLauncher& launcher, const ScalingSubject& subject,
                                   const ScalingMachine& machine, const std::string& out) {
  std::vector<std::string> words;
  if (machine.ranks > 1) {
    words = launcher.mpirun.empty() ? std::vector<std::string>{"mpirun", "--bind-to", "core", "--map-by",
                                                               fmt::format("slot:PE={}", machine.threads)}
                                    : launcher.mpirun;
    words.insert(words.end(), {"-n", fmt::format("{}", machine.ranks)});
  }
  words.insert(words.end(), {launcher.talus, "run", subject.scene, "--out", out, "--threads",
                             fmt::format("{}", machine.threads), "--steps", fmt::format("{}", launcher.last),
                             "--set", fmt::format("decomposition.subdomains={}", machine.subdomains)});
  for (const std::string& override_text : split_words(subject.variant))
    words.insert(words.end(), {"--set", override_text});
  return words;
}

RunTimes read_times(const fs::path& steps_csv, std::int64_t first, std::int64_t last) {
  std::ifstream in(steps_csv);
  std::string line;
  if (!std::getline(in, line)) throw io::FileError(steps_csv.string(), "the run left no table of its steps");
  const std::vector<std::string> names = cells_of(line);
  const auto column = [&](const char* name) {
    const auto at = std::ranges::find(names, name);
    if (at == names.end()) throw io::FileError(steps_csv.string(), fmt::format("has no column {}", name));
    return static_cast<std::size_t>(at - names.begin());
  };
  const std::size_t step = column("step"), iterations = column("iterations"), contacts = column("contacts"),
                    seconds = column("wall_s"), converged = column("converged");
  RunTimes sum;
  std::int64_t counted = 0;
  while (std::getline(in, line)) {
    const std::vector<std::string> cells = cells_of(line);
    if (cells.size() != names.size()) continue;  // cut off by a kill
    const std::int64_t number = std::stoll(cells[step]);
    if (number < first || number > last) continue;
    ++counted;
    sum.seconds += std::stod(cells[seconds]);
    sum.iterations += std::stod(cells[iterations]);
    sum.contacts += std::stod(cells[contacts]);
    if (cells[converged] == "0") ++sum.missed;
  }
  if (counted != last - first + 1)
    throw io::FileError(steps_csv.string(),
                        fmt::format("has {} of the steps {} to {}: the scene ends before. Ask for earlier "
                                    "ones with --steps",
                                    counted, first, last));
  const auto count = static_cast<double>(counted);
  sum.seconds /= count;
  sum.iterations /= count;
  sum.contacts /= count;
  return sum;
}

RunTimes run_once(const ScalingLauncher& launcher, const ScalingSubject& subject,
                  const ScalingMachine& machine) {
  const io::ScratchFolder scratch(launcher.work);
  return start(launcher, run_words(launcher, subject, machine, (scratch.path() / "out").string()),
               scratch.path());
}

RunTimes record_once(const ScalingLauncher& launcher, const ScalingSubject& subject, int subdomains,
                     bool own_caches, const fs::path& trace) {
  const io::ScratchFolder scratch(launcher.work);
  std::vector<std::string> words =
      run_words(launcher, subject, {subdomains, 1, 1}, (scratch.path() / "out").string());
  words.push_back("--trace");
  words.push_back("--trace-steps");
  words.push_back(fmt::format("{}:{}", launcher.first, launcher.last));
  if (own_caches) words.emplace_back("--trace-own-caches");
  const RunTimes times = start(launcher, words, scratch.path());
  fs::create_directories(trace.parent_path());
  fs::rename(scratch.path() / "out" / "trace.h5", trace);
  return times;
}

RunTimes simulate_once(const ScalingLauncher& launcher, const SimulatedLauncher& simulated,
                       const ScalingSubject& subject, const trace::Machine& machine) {
  const io::ScratchFolder scratch(launcher.work);
  const fs::path platform = scratch.path() / "platform.xml", hosts = scratch.path() / "hosts";
  io::write_whole(platform, io::smpi_platform(machine));
  io::write_whole(hosts, io::smpi_hosts(machine));
  std::vector<std::string> words{
      simulated.smpirun, "-np", fmt::format("{}", machine.ranks), "-hostfile", hosts, "-platform", platform};
  ScalingLauncher inside = launcher;
  inside.talus = fs::absolute(simulated.talus);
  const std::vector<std::string> run =
      run_words(inside, subject, {machine.ranks, 1, 1}, (scratch.path() / "out").string());
  words.insert(words.end(), run.begin(), run.end());
  return start(launcher, words, scratch.path());
}

std::vector<RecordedTrace> read_recordings(const fs::path& times_csv) {
  std::vector<RecordedTrace> recorded;
  std::ifstream in(times_csv);
  std::string line;
  std::getline(in, line);
  while (std::getline(in, line)) {
    const std::vector<std::string> cells = cells_of(line);
    try {
      if (cells.size() != 7) throw std::invalid_argument(line);
      recorded.push_back(
          {cells[0],
           cells[2],
           cells[1],
           {std::stod(cells[3]), std::stod(cells[4]), std::stod(cells[5]), std::stoll(cells[6])}});
    } catch (const std::logic_error&) {
      throw io::FileError(
          times_csv.string(),
          fmt::format("'{}' is no line of a list of recordings; --force records them anew", line));
    }
  }
  return recorded;
}

void write_recordings(const fs::path& times_csv, const std::vector<RecordedTrace>& recorded) {
  io::CsvTable table({"file", "variant", "steps", "seconds", "iterations", "contacts", "missed"});
  for (const RecordedTrace& r : recorded)
    table.row(r.file, r.variant, r.steps, r.times.seconds, r.times.iterations, r.times.contacts,
              r.times.missed);
  io::write_whole(times_csv, table.text());
}

std::vector<int> rank_counts(int cores) {
  std::vector<int> counts;
  for (int ranks = 1; ranks <= cores; ++ranks)
    if (cores % ranks == 0) counts.push_back(ranks);
  return counts;
}

ScalingRow row_of(const ScalingSubject& subject, const ScalingMachine& machine,
                  const std::vector<RunTimes>& times) {
  ScalingRow row;
  row.kind = subject.kind;
  row.variant = subject.variant;
  row.subdomains = machine.subdomains;
  row.ranks = machine.ranks;
  row.threads = machine.threads;
  row.grains = subject.grains;
  row.repeats = static_cast<int>(times.size());
  const auto values = [&](double RunTimes::*member) {
    std::vector<double> all;
    for (const RunTimes& time : times) all.push_back(time.*member);
    return all;
  };
  const std::vector<double> seconds = values(&RunTimes::seconds);
  row.seconds = median(seconds);
  row.fastest = std::ranges::min(seconds);
  row.slowest = std::ranges::max(seconds);
  row.iterations = median(values(&RunTimes::iterations));
  row.contacts = median(values(&RunTimes::contacts));
  for (const RunTimes& time : times) row.missed = std::max(row.missed, time.missed);
  return row;
}

}  // namespace talus
