#include "apps/commands/replay_command.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include "apps/shared/exit_codes.hpp"
#include "apps/shared/print.hpp"
#include "io/files/detail/with_unit.hpp"
#include "io/files/output_directory.hpp"
#include "io/trace/smpi_platform.hpp"
#include "io/trace/trace_file.hpp"
#include "runtime/trace/analysis.hpp"

namespace talus {

namespace {

void print(const char* name, const std::string& value, const char* label = "") {
  print_out("{:<28} {}{}{}\n", name, value, *label ? "   " : "", label);
}

std::string seconds(double ns) {
  return io::detail::with_unit(1e-9 * ns, "s");
}

std::string percent(double part) {
  return fmt::format("{:.1f} %", 100 * part);
}

/// Makespan of the recording itself [ns].
double recorded_makespan(const trace::Trace& trace) {
  return trace::analyse(trace).makespan;
}

void write_platform(const std::string& file, const std::string& platform, const trace::Machine& machine) {
  io::write_whole(file, platform);
  std::string hosts;
  if (machine.ranks_per_node > 1) {
    io::write_whole(file + ".hosts", io::smpi_hosts(machine));
    hosts = fmt::format("-hostfile {}.hosts ", file);
  }
  print_out("\nthe machine for SMPI: smpirun -np {} {}-platform {} build/smpi/talus run SCENE ...\n",
            machine.ranks, hosts, file);
}

/// Plays what was recorded on the machine `there`, prints, and returns what would have been.
trace::Trace report(const ReplayOptions& options, const trace::Timeline& timeline,
                    const trace::Machine& there, const trace::Machine& machine) {
  const trace::Trace& recorded = timeline.trace();
  const char* label = !recorded.predicted && machine == there ? "" : "predicted";
  trace::Replay played = trace::replay(timeline, machine, true);
  trace::Machine chain = machine;
  chain.unbounded = true;
  chain.noise = 0;
  const double longest = trace::replay(timeline, chain, false).makespan;
  trace::Machine single = machine;
  single.ranks = single.threads = 1;
  single.noise = 0;
  const double alone = trace::replay(timeline, single, false).makespan;
  const double workers = static_cast<double>(machine.ranks) * machine.threads;
  const trace::Summary summary = trace::analyse(played.trace);
  const double recorded_time = recorded_makespan(recorded);

  print_out("{}: {} ranks x {} threads, {} steps, {} tasks\n", options.file, recorded.ranks, recorded.threads,
            timeline.steps().size(), played.tasks);
  print_out(
      "machine: {} ranks x {} threads, map {}, schedule {}, latency {}, bandwidth {}, overhead {}, {} ranks "
      "a node\n",
      machine.ranks, machine.threads, name_of(machine.map), name_of(machine.schedule),
      io::detail::with_unit(machine.latency, "s"), io::detail::with_unit(machine.bandwidth, "B/s"),
      io::detail::with_unit(machine.overhead, "s"), machine.ranks_per_node);
  print("makespan", seconds(played.makespan), label);
  print(recorded.predicted ? "predicted before" : "recorded makespan",
        fmt::format("{}   (replay {:+.1f} %)", seconds(recorded_time),
                    100 * (played.makespan / recorded_time - 1)));
  print("work of all tasks", seconds(played.work), label);
  // The tasks of a prediction hold what messages cost its ranks, which one rank would not pay.
  if (!recorded.predicted)
    print("speedup over 1 x 1",
          fmt::format("{:.2f} of {:.0f}, {}", alone / played.makespan, workers,
                      percent(alone / (played.makespan * workers))),
          label);
  print("exposed messages", percent(summary.exposed / (played.makespan * workers)), label);
  print("waiting and idle", percent(summary.idle / (played.makespan * workers)), label);
  print("bound: longest chain", seconds(longest), label);
  print("bound: work / workers", seconds(played.work / workers), label);
  if (options.steps)
    print(
        "for all steps",
        fmt::format("{}   ({:.0f} steps like the mean of these)",
                    seconds(played.makespan * *options.steps / static_cast<double>(timeline.steps().size())),
                    *options.steps),
        "predicted");
  print_out("\n{}", trace::describe(summary));
  return std::move(played.trace);
}

/// Of --steps: times of more would no longer be whole in double precision.
constexpr double most_steps = 1e15;

}  // namespace

int replay_command(ReplayOptions options) {
  trace::Machine machine = options.machine;
  std::string platform;
  trace::Trace played;
  try {
    const std::string& file = options.smpi_platform;
    io::check_output_files({options.file}, {options.out, file, file.empty() ? "" : file + ".hosts"},
                           options.force);
    if (options.steps && !(*options.steps >= 1 && *options.steps <= most_steps))
      throw std::invalid_argument(
          fmt::format("--steps must be 1 to {:g}, got {}", most_steps, *options.steps));
    const trace::Trace recorded = io::read_trace(options.file);
    machine.ranks = options.ranks.value_or(recorded.ranks);
    machine.threads = options.threads.value_or(recorded.threads);
    const trace::Machine there = trace::recorded_machine(recorded);
    machine.ranks_per_node =
        options.ranks_per_node.value_or(machine.ranks == recorded.ranks ? there.ranks_per_node : 1);
    machine.node_latency = options.node_latency.value_or(there.node_latency);
    machine.map = options.map.empty() ? there.map : trace::rank_map_named(options.map);
    machine.schedule = trace::schedule_named(options.schedule);
    machine.late_check = !options.blocking_check;
    validate(machine, recorded);
    if (!options.smpi_platform.empty()) {
      if (!options.map.empty() && machine.map != trace::RankMap::block)
        throw std::invalid_argument(
            fmt::format("--map {}: a platform for SMPI has no map; it is the program's, see "
                        "decomposition.mapping",
                        options.map));
      platform = io::smpi_platform(machine);
    }
    const trace::Timeline timeline(recorded);
    played = report(options, timeline, there, machine);
  } catch (const std::exception& error) {
    print_error("talus: error: {}\n", error.what());
    return exit_bad_input;
  }
  try {
    if (!options.smpi_platform.empty()) write_platform(options.smpi_platform, platform, machine);
    if (!options.out.empty())
      io::write_by_draft(options.out,
                         [&](const std::filesystem::path& draft) { io::write_trace(draft, played); });
  } catch (const std::exception& error) {
    print_error("talus: error: {}\n", error.what());
    return exit_failure;
  }
  return exit_done;
}

}  // namespace talus
