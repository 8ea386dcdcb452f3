#include "apps/commands/run.hpp"

#include <fmt/format.h>
#include <omp.h>

#include <cstdio>
#include <memory>
#include <optional>
#include <stdexcept>
#include <utility>

#include "apps/commands/dump_fclib.hpp"
#include "apps/commands/run_messages.hpp"
#include "apps/commands/run_ranks.hpp"
#include "apps/commands/run_steps.hpp"
#include "apps/commands/step_list.hpp"
#include "apps/shared/exit_codes.hpp"
#include "apps/shared/sample_builder.hpp"
#include "apps/shared/scene_warnings.hpp"
#include "apps/shared/trace_feed.hpp"
#include "io/files/error.hpp"
#include "io/files/output_directory.hpp"
#include "io/output/sinks.hpp"
#include "io/results/run_json.hpp"
#include "io/scene/scene.hpp"
#include "io/trace/trace_file.hpp"
#include "runtime/graph/clock.hpp"
#include "runtime/step/simulation.hpp"

namespace talus {

namespace {

int threads_of(const RunOptions& options) {
  if (graph::simulated_ranks) return 1;
  return options.threads > 0 ? options.threads : omp_get_num_procs();
}

/// The order that the run is to follow. Throws std::invalid_argument when it was recorded on another machine.
trace::Trace order_of(const RunOptions& options, const graph::Communicator& ranks) {
  trace::Trace recorded = io::read_trace(options.replay_order);
  if (recorded.ranks != ranks.ranks() || recorded.threads != threads_of(options))
    throw std::invalid_argument(fmt::format("{} was recorded on {} ranks x {} threads, this run has {} x {}",
                                            options.replay_order, recorded.ranks, recorded.threads,
                                            ranks.ranks(), threads_of(options)));
  return recorded;
}

/// Fills in the directory and the provenance of `run`, and runs.
int run_scene(PreparedRun run, Sample sample) {
  const RunOptions& options = run.options;
  const io::Scene& scene = run.scene;
  const graph::Communicator& ranks = run.ranks;
  run.directory = options.out.empty() ? scene.output.directory : options.out;
  run.provenance = io::collect_provenance();
  run.provenance.threads = threads_of(options);
  run.provenance.simd = name_of(SweepKernels(settled(scene.setup.solver.simd, ranks)).set());
  run.provenance.command_line = options.command_line;
  run.provenance.seed = scene.setup.seed;
  run.provenance.scene_file = scene.source_file;
  std::string refused;
  std::optional<io::DirectoryLock> lock;
  if (ranks.rank() == 0) {
    try {
      lock.emplace(io::prepare_output_directory(run.directory, options.force, io::is_output_name));
    } catch (const io::FileError& error) {
      refused = error.what();
    }
  }
  if (any_refused(refused, ranks)) return exit_bad_input;
  if (ranks.rank() == 0) {
    io::write_whole(run.directory + "/scene.resolved.toml", io::resolved_scene(scene));
    print_start(scene, sample.size(), run.provenance.threads, ranks);
  }
  const io::Summary summary = simulate(run, std::move(sample));
  if (ranks.rank() == 0) {
    print_end(summary, scene.setup.solver, run.directory);
  } else if (summary.status == "failed") {
    fmt::print(stderr, "talus: rank {}: {}\n", ranks.rank(), summary.message);
  }
  if (summary.status == "failed" && ranks.ranks() > 1) end_all(summary.exit_code, ranks);
  return summary.exit_code;
}

}  // namespace

int run_command(const RunOptions& options, const graph::Communicator& ranks) {
  io::Scene scene;
  Sample sample;
  Recordings recordings;
  std::vector<std::string> warnings;
  std::string refused;
  try {
    if (options.threads < 0)
      throw std::invalid_argument(fmt::format("--threads must be at least 1, got {}", options.threads));
    if (graph::simulated_ranks && options.threads > 1)
      throw std::invalid_argument(
          fmt::format("--threads {}: simulated ranks have one thread each", options.threads));
    graph::demand_thread_level(ranks.thread_level(), ranks.ranks(), threads_of(options));
    if (!options.replay_order.empty())
      recordings.order = std::make_unique<trace::Order>(order_of(options, ranks), ranks.rank());
    if (!options.task_times.empty())
      recordings.times =
          std::make_unique<trace::TaskTimes>(io::read_trace(options.task_times), ranks.ranks(), ranks.rank());
    if (options.steps && *options.steps < 1)
      throw std::invalid_argument(fmt::format("--steps must be at least 1, got {}", *options.steps));
    if (!options.trace_steps.empty()) parse_steps(options.trace_steps);
    if (options.trace_own_caches && (ranks.ranks() > 1 || threads_of(options) > 1))
      throw std::invalid_argument(
          "--trace-own-caches: other threads and ranks would wait for what is brought in; record on one rank "
          "with --threads 1");
    if (!options.error_history.empty()) StepList(options.error_history);  // refuses what is none
    scene = io::load_scene(options.scene, options.overrides);
    if (!options.dump_fclib.empty()) check_dump(scene.setup, ranks.ranks());
    make_decomposition(scene.setup.decomposition, ranks);  // refuses what does not fit the ranks
    if (ranks.rank() == 0) {
      sample = build_sample(scene);
      io::place_walls(scene, sample);
      warnings = scene_warnings(scene, sample);
      for (const std::string& warning : warnings) fmt::print(stderr, "talus: warning: {}\n", warning);
    }
    if (options.dry_run && ranks.rank() == 0) {
      fmt::print("{}", io::resolved_scene(scene));
      fmt::print(stderr, "talus: {}: {}; the scene is sound, nothing was written (--dry-run)\n",
                 options.scene, contents(scene, sample.size()));
    }
  } catch (const std::exception& error) {
    refused = error.what();
  }
  if (any_refused(refused, ranks)) return exit_bad_input;
  if (options.dry_run) return exit_done;
  share_walls(scene.setup, ranks);
  stop_on_signals();
  try {
    return run_scene({options, scene, recordings, ranks, {}, {}, std::move(warnings)}, std::move(sample));
  } catch (const std::exception& error) {
    fmt::print(stderr, "talus: error: {}\n", error.what());
    if (ranks.ranks() > 1) end_all(exit_failure, ranks);
    return exit_failure;
  }
}

}  // namespace talus
