#include "apps/commands/commands.hpp"

#include <string>
#include <utility>
#include <vector>

#include "apps/commands/replay_command.hpp"
#include "apps/shared/options.hpp"

namespace talus {

namespace {

/// From "KIND=X", each.
void set_speeds(const std::vector<std::string>& given, trace::Machine& machine) {
  for (const std::string& text : given) {
    const std::size_t sign = text.find('=');
    double speed = 0;
    if (sign == std::string::npos || !CLI::detail::lexical_cast(text.substr(sign + 1), speed))
      throw CLI::ValidationError("--speed-of", "'" + text + "' is not KIND=X, as in glue=3");
    machine.speed_of[text.substr(0, sign)] = speed;
  }
}

void add_options(CLI::App& app, ReplayOptions& options) {
  app.add_option("file", options.file, "trace.h5 of a run")->type_name("FILE")->required();
  app.add_option("--ranks", options.ranks, "ranks [as recorded]")->type_name("R");
  app.add_option("--threads", options.threads, "threads of a rank [as recorded]")
      ->type_name("T")
      ->check(thread_count());
  app.add_option("--map", options.map, "subdomains to ranks: block, cyclic or weight [as recorded]");
  app.add_option("--schedule", options.schedule, "fixed, as the program does it, or list")
      ->capture_default_str();
  app.add_option("--latency", options.machine.latency, "of a message between nodes [s]")
      ->capture_default_str();
  app.add_option("--bandwidth", options.machine.bandwidth, "of a node's link, each way [B/s]")
      ->capture_default_str();
  app.add_option("--overhead", options.machine.overhead, "of a thread per message sent or taken [s]")
      ->capture_default_str();
  app.add_option("--ranks-per-node", options.ranks_per_node, "ranks that share a link [1; all as recorded]");
  app.add_option("--node-latency", options.node_latency,
                 "of a message inside a node [s] [as recorded, or 5e-7]");
  app.add_option("--node-bandwidth", options.machine.node_bandwidth, "of a message inside a node [B/s]")
      ->capture_default_str();
  app.add_option("--line", options.machine.line, "to hand a cache line to another core [s]")
      ->capture_default_str();
  app.add_option("--noise", options.machine.noise,
                 "each task, but not checks and what ranks do alone, takes up to this part longer")
      ->capture_default_str();
  app.add_option("--seed", options.machine.seed, "of the noise")
      ->capture_default_str()
      ->check(not_negative());
  app.add_option("--speed", options.machine.speed, "of a core, relative to the recorded one")
      ->capture_default_str();
  app.add_option_function<std::vector<std::string>>(
         "--speed-of",
         [&options](const std::vector<std::string>& given) { set_speeds(given, options.machine); },
         "the same for one kind of tasks, instead: glue=3")
      ->type_name("KIND=X");
  app.add_option("--contacts-scale", options.machine.contacts,
                 "contacts per subdomain, relative to the recorded ones")
      ->capture_default_str();
  app.add_option("--steps", options.steps, "extrapolate the makespan to so many steps");
  app.add_flag(
      "--typical", options.machine.typical,
      "tasks that took over three times their median of the step take the median: for noisy recordings");
  app.add_option(
      "--quantile", options.machine.quantile,
      "tasks take this quantile of their times in the step: for recordings on a busy machine [off]");
  app.add_flag("--blocking-check", options.blocking_check, "convergence checks wait for their sums");
  app.add_option("--smpi-platform", options.smpi_platform,
                 "write the machine for smpirun, which runs the real program on it (preset smpi)")
      ->type_name("FILE");
  app.add_option("-o,--out", options.out, "write what would have been, as a trace")->type_name("FILE");
  app.add_flag("--force", options.force, "replace these files where they are there");
}

}  // namespace

Command replay_entry() {
  return command<ReplayOptions>(
      "replay", "play a trace on another machine: what a run there would take", add_options,
      [](ReplayOptions& options, CommandLine) { return replay_command(std::move(options)); });
}

}  // namespace talus
