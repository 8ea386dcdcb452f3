#include "apps/commands/run.hpp"

#include <fmt/format.h>
#include <omp.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <utility>

#include "apps/commands/dump_fclib.hpp"
#include "apps/commands/run_limit.hpp"
#include "apps/commands/run_messages.hpp"
#include "apps/commands/run_ranks.hpp"
#include "apps/commands/run_resume.hpp"
#include "apps/commands/run_status.hpp"
#include "apps/commands/run_steps.hpp"
#include "apps/commands/step_list.hpp"
#include "apps/commands/threads.hpp"
#include "apps/report/run_report.hpp"
#include "apps/shared/exit_codes.hpp"
#include "apps/shared/placed_sample.hpp"
#include "apps/shared/print.hpp"
#include "apps/shared/sample_builder.hpp"
#include "apps/shared/scene_warnings.hpp"
#include "apps/shared/signals.hpp"
#include "apps/shared/trace_feed.hpp"
#include "io/files/crc.hpp"
#include "io/files/error.hpp"
#include "io/files/output_directory.hpp"
#include "io/output/sinks.hpp"
#include "io/results/run_json.hpp"
#include "io/scene/scene.hpp"
#include "io/scene/scene_change.hpp"
#include "io/trace/trace_file.hpp"
#include "runtime/graph/clock.hpp"
#include "runtime/step/simulation.hpp"

namespace talus {

namespace {

/// As asked, or as many as there can be.
int most_threads(const RunOptions& options) {
  if (graph::simulated_ranks) return 1;
  return options.threads > 0 ? options.threads : omp_get_num_procs();
}

/// What a run is made of once the ranks agree that it can begin.
struct Prepared {
  io::Scene scene;
  Sample sample;
  std::vector<GivenForce> forces;
  Recordings recordings;
  std::vector<io::InputFile> input_files;  ///< rank 0's
  std::vector<std::string> warnings;
  std::string directory;
  std::string resolved;  ///< the scene as it was loaded
  double wall_mass = 0;
  std::optional<double> granted;
  std::optional<io::DirectoryLock> lock;  ///< of a run that goes on: rank 0's, from before it reads
  std::optional<ResumePoint> point;
  std::optional<int> nothing_left;     ///< exit code of the run that has been done
  std::optional<std::int64_t> enough;  ///< its last step, where --steps asks for no more
  int threads = 1;                     ///< of each rank
};

/// The order that the run is to follow, on as many threads unless others are asked for. Throws
/// std::invalid_argument when it was recorded on another machine.
trace::Trace order_of(const RunOptions& options, const graph::Communicator& ranks, int& threads) {
  trace::Trace recorded = io::read_trace(options.replay_order);
  if (options.threads == 0 && !graph::simulated_ranks) threads = recorded.threads;
  if (recorded.ranks != ranks.ranks() || recorded.threads != threads)
    throw std::invalid_argument(fmt::format("{} was recorded on {} ranks x {} threads, this run has {} x {}",
                                            options.replay_order, recorded.ranks, recorded.threads,
                                            ranks.ranks(), threads));
  return recorded;
}

void check_options(const RunOptions& options) {
  if (options.threads < 0)
    throw std::invalid_argument(fmt::format("--threads must be at least 1, got {}", options.threads));
  if (graph::simulated_ranks && options.threads > 1)
    throw std::invalid_argument(
        fmt::format("--threads {}: simulated ranks have one thread each", options.threads));
  if (options.steps && *options.steps < 1)
    throw std::invalid_argument(fmt::format("--steps must be at least 1, got {}", *options.steps));
  if (!options.trace_steps.empty()) parse_steps(options.trace_steps);
  if (!options.error_history.empty()) StepList(options.error_history);  // refuses what is none
  if (options.resume && options.force)
    throw std::invalid_argument(
        "--resume goes on with the results that --force removes: give one of the two");
}

void read_recordings(const RunOptions& options, const graph::Communicator& ranks, Prepared& run) {
  if (!options.replay_order.empty())
    run.recordings.order =
        std::make_unique<trace::Order>(order_of(options, ranks, run.threads), ranks.rank());
  if (!options.task_times.empty())
    run.recordings.times =
        std::make_unique<trace::TaskTimes>(io::read_trace(options.task_times), ranks.ranks(), ranks.rank());
}

/// Where the run goes on, if it does. Collective, but for what it throws.
void look_for_checkpoint(const RunOptions& options, const graph::Communicator& ranks,
                         const Terminal& terminal, Prepared& run) {
  run.point = find_resume_point(run.directory, run.scene, ranks, terminal);
  const EarlierRun earlier = earlier_run(run.directory);
  // A run that makes no step takes no checkpoint: only what lies beside it tells that its end was a nearer
  // one. Rank 0 asks for all, as for checkpoints.
  double ended[1] = {ranks.rank() == 0 && earlier.complete && has_ends_of(run.directory, run.scene) ? 1.
                                                                                                    : 0.};
  ranks.max(ended);
  if (run.point) {
    compare_scenes(run.scene, run.resolved, *run.point);
    if (ended[0] > 0 && run.point->changes.empty()) run.nothing_left = earlier.exit_code;
    const std::int64_t step = run.point->file.state.head.report.step;
    if (!run.nothing_left && earlier.done && options.steps && step >= *options.steps) {
      run.nothing_left = earlier.exit_code;
      run.enough = step;
    }
    if (ranks.rank() == 0 && !run.nothing_left)
      demand_files_of_run(run.directory, run.scene.output, run.point->memory.mark, !options.dry_run);
    take_over(*run.point, run.scene);
    run.warnings = earlier.warnings;
  } else if (earlier.complete) {
    run.nothing_left = earlier.exit_code;
  }
}

/// Grains that the run begins or goes on with, on rank 0.
std::size_t grains_of(const Prepared& run) {
  return run.point ? static_cast<std::size_t>(run.point->file.state.head.size.bodies) : run.sample.size();
}

/// Collective. What nobody has said of threads follows from the grains.
void settle_threads(const RunOptions& options, const graph::Communicator& ranks, Prepared& run) {
  if (options.threads > 0 || run.recordings.order) return;
  std::int64_t grains = ranks.rank() == 0 ? static_cast<std::int64_t>(grains_of(run)) : 0;
  ranks.sum(std::span(&grains, 1));
  run.threads = threads_for(run.scene, grains, ranks.ranks(), run.threads);
}

void check_threads(const RunOptions& options, const graph::Communicator& ranks, int threads) {
  graph::demand_thread_level(ranks.thread_level(), ranks.ranks(), threads);
  if (options.trace_own_caches && (ranks.ranks() > 1 || threads > 1))
    throw std::invalid_argument(
        "--trace-own-caches: other threads and ranks would wait for what is brought in; record on one rank "
        "with --threads 1");
}

void print_warnings(const Terminal& terminal, const Prepared& run) {
  for (const std::string& warning : run.warnings) terminal.warn("warning: {}", warning);
}

/// What is to be said of the sample.
void speak_of_sample(const RunOptions& options, const Terminal& terminal, Prepared& run) {
  run.wall_mass = io::automatic_wall_mass(run.sample);
  std::ranges::move(scene_warnings(run.scene, run.sample), std::back_inserter(run.warnings));
  if (!options.dry_run) return;
  print_warnings(terminal, run);
  print_out("{}", io::resolved_scene(run.scene));
  print_error("talus: {}: {}; the scene is sound, nothing was written (--dry-run)\n", options.scene,
              contents(run.scene, run.sample.size()));
}

/// Collective: false when any rank refuses, which has been said.
bool prepare(const RunOptions& options, const graph::Communicator& ranks, const Terminal& terminal,
             Prepared& run) {
  const auto agreed = [&](const auto& work) {
    std::string refused;
    try {
      work();
    } catch (const std::exception& error) {
      refused = error.what();
    }
    return !any_refused(refused, ranks);
  };
  const bool loaded = agreed([&] {
    check_options(options);
    run.threads = most_threads(options);
    read_recordings(options, ranks, run);
    std::optional<double> given;
    if (!options.max_walltime.empty()) given = parse_duration(options.max_walltime);
    run.granted = time_granted(given);
    run.scene = io::load_scene(options.scene, options.overrides);
    run.resolved = io::resolved_scene(run.scene);
    run.directory = options.out.empty() ? run.scene.output.directory : options.out;
    if (!options.dump_fclib.empty()) check_dump(run.scene.setup, ranks.ranks());
    make_decomposition(run.scene.setup.decomposition, ranks);  // refuses what does not fit the ranks
    if (options.resume && ranks.rank() == 0 && std::filesystem::is_directory(run.directory))
      run.lock.emplace(run.directory);
  });
  if (!loaded) return false;
  if (options.resume && !agreed([&] { look_for_checkpoint(options, ranks, terminal, run); })) return false;
  const bool placed = agreed([&] {
    if (ranks.rank() != 0) return;
    for (const std::string& file : io::input_files(run.scene))
      run.input_files.push_back({file, io::crc_of_file(file)});
    demand_memory_of_graph(run.scene, ranks.ranks());
    if (run.point) return;
    PlacedSample placed_sample = place_sample(run.scene);
    run.sample = std::move(placed_sample.sample);
    run.forces = std::move(placed_sample.forces);
    run.warnings = std::move(placed_sample.warnings);
    // scene.resolved.toml says where the walls stood
    if (options.resume && std::filesystem::is_directory(run.directory))
      demand_results_of_scene(run.directory, run.scene, run.nothing_left.has_value());
    if (!run.nothing_left) speak_of_sample(options, terminal, run);
  });
  if (!placed) return false;
  settle_threads(options, ranks, run);
  return agreed([&] { check_threads(options, ranks, run.threads); });
}

std::vector<std::filesystem::path> files_read(const RunOptions& options, const io::Scene& scene) {
  std::vector<std::filesystem::path> files = io::files_read(scene);
  files.emplace_back(options.scene);
  for (const std::string& trace : {options.replay_order, options.task_times})
    if (!trace.empty()) files.emplace_back(trace);
  return files;
}

/// The results are those of a run from here on: a directory of its own, or the one that it goes on in.
bool take_directory(const RunOptions& options, const graph::Communicator& ranks, Prepared& run) {
  std::string refused;
  if (ranks.rank() == 0 && !run.point) {
    try {
      run.lock.reset();
      run.lock.emplace(io::prepare_output_directory(run.directory, options.force || options.resume,
                                                    io::is_output_name, files_read(options, run.scene),
                                                    resolved_text));
    } catch (const io::FileError& error) {
      refused = error.what();
    }
  }
  return !any_refused(refused, ranks);
}

io::Provenance provenance_of(const RunOptions& options, const graph::Communicator& ranks,
                             const Prepared& run) {
  const io::Scene& scene = run.scene;
  io::Provenance provenance = io::collect_provenance();
  provenance.threads = run.threads;
  provenance.simd = name_of(SweepKernels(settled(scene.setup.solver.simd, ranks)).set());
  provenance.command_line = options.command_line;
  provenance.seed = scene.setup.seed;
  provenance.scene_file = scene.source_file;
  provenance.input_files = run.input_files;
  if (!run.point) return provenance;
  provenance.resumed = io::resumptions_in(run.directory + "/run.json");
  io::Resumption now{provenance.date_utc,
                     provenance.host,
                     ranks.ranks(),
                     provenance.threads,
                     run.point->file.state.head.report.step,
                     {}};
  for (const io::SceneChange& change : run.point->changes) now.changes.push_back(io::describe(change));
  provenance.resumed.push_back(std::move(now));
  return provenance;
}

void print_resumption(const Terminal& terminal, const ResumePoint& point) {
  const CheckpointHead& head = point.file.state.head;
  terminal.say("goes on behind step {}, {:.6g} s simulated, from {}", head.report.step, head.report.time,
               point.path.string());
  for (const io::SceneChange& change : point.changes) terminal.say("from here on {}", io::describe(change));
}

/// The page of the run. What it lacks room or memory for is no fault of the run.
void write_page(const Terminal& terminal, const std::string& directory, bool in_haste) {
  if (in_haste) {
    terminal.say("report.html was left out, as time is limited; `talus report {}` writes it", directory);
    return;
  }
  try {
    io::write_whole(directory + "/report.html", run_report(directory));
  } catch (const std::exception& error) {
    terminal.warn("warning: report.html was not written: {}", error.what());
  }
}

/// Rank 0 waits for this rank, and cannot write that the run has failed.
void say_for_rank_0(const std::string& directory, const io::Provenance& provenance, io::Summary summary,
                    const graph::Communicator& ranks) {
  summary.message = fmt::format("rank {}: {}", ranks.rank(), summary.message);
  io::write_run_json(directory + "/run.json", provenance, summary);
}

/// Fills in the provenance of the run, and runs.
int run_scene(const RunOptions& options, const graph::Communicator& ranks, Terminal& terminal, Prepared run,
              double began) {
  if (!take_directory(options, ranks, run)) return exit_bad_input;
  const io::Scene& scene = run.scene;
  const io::Provenance provenance = provenance_of(options, ranks, run);
  if (ranks.rank() == 0) {
    terminal.keep_in(run.directory + "/run.log", run.point.has_value());
    io::write_whole(run.directory + "/scene.resolved.toml", io::resolved_scene(scene));
    StatusFile(run.directory).begin();
    print_start(terminal, scene, grains_of(run), provenance.threads, ranks);
    if (run.point)
      print_resumption(terminal, *run.point);
    else
      print_warnings(terminal, run);
  }
  const PreparedRun prepared{options,      scene,         run.recordings,
                             ranks,        terminal,      run.point ? &*run.point : nullptr,
                             run.resolved, run.wall_mass, began,
                             run.granted,  run.directory, provenance,
                             run.warnings};
  const io::Summary summary = simulate(prepared, std::move(run.sample), std::move(run.forces));
  if (ranks.rank() == 0) {
    print_end(terminal, summary, scene.setup.solver, run.directory);
    write_page(terminal, run.directory, summary.status == "stopped" && run.granted);
  } else if (summary.status == "failed")
    terminal.warn("rank {}: {}", ranks.rank(), summary.message);
  if (summary.status == "failed" && ranks.ranks() > 1)
    end_all(summary.exit_code, ranks, [&] { say_for_rank_0(run.directory, provenance, summary, ranks); });
  return summary.exit_code;
}

/// Collective. A signal has asked to stop before any step.
bool stopped_before_a_step(const graph::Communicator& ranks, bool goes_on) {
  double signal[1] = {static_cast<double>(stop_signal())};
  ranks.max(signal);
  if (signal[0] > 0 && ranks.rank() == 0)
    print_error("talus: stopped: {} before {}\n", signal_name(static_cast<int>(signal[0])),
                goes_on ? "the run went on" : "the first step; nothing was written");
  return signal[0] > 0;
}

}  // namespace

int run_command(const RunOptions& options, const graph::Communicator& ranks) {
  const double began = graph::seconds_now();
  Terminal terminal(options.quiet);
  Prepared run;
  catch_signals();
  const bool prepared = prepare(options, ranks, terminal, run);
  const bool has_steps = !prepared || !(options.dry_run || run.nothing_left);
  if (has_steps && stopped_before_a_step(ranks, run.point.has_value())) return exit_stopped;
  if (!prepared) return exit_bad_input;
  if (options.dry_run) return exit_done;
  if (run.nothing_left) {
    if (ranks.rank() == 0 && run.enough)
      terminal.say("the run in {} has made {} steps, and --steps {} asks for no more; nothing was done",
                   run.directory, *run.enough, *options.steps);
    else if (ranks.rank() == 0)
      terminal.say("the run in {} is done; to go on beyond its end, give its stage another one with --set",
                   run.directory);
    if (ranks.rank() == 0)
      if (const std::string fault = fault_of_results(run.directory, run.scene.output); !fault.empty())
        terminal.warn("warning: {}; the run is done, and does not write it again", fault);
    // Who killed the run while the page was drawn gets it now.
    std::error_code unknown;
    if (ranks.rank() == 0 && !std::filesystem::exists(run.directory + "/report.html", unknown))
      write_page(terminal, run.directory, false);
    return *run.nothing_left;
  }
  share_start(run.scene.setup, ranks);
  try {
    return run_scene(options, ranks, terminal, std::move(run), began);
  } catch (const std::exception& error) {
    terminal.warn("error: {}", error.what());
    if (ranks.ranks() > 1) end_all(exit_failure, ranks);
    return exit_failure;
  }
}

}  // namespace talus
