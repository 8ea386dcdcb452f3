#include "apps/commands/run.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <omp.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>
#include <set>
#include <sstream>

#include "apps/commands/dump_fclib.hpp"
#include "apps/commands/step_list.hpp"
#include "apps/shared/exit_codes.hpp"
#include "apps/shared/sample_builder.hpp"
#include "apps/shared/trace_feed.hpp"
#include "io/files/error.hpp"
#include "io/files/output_directory.hpp"
#include "io/output/recorder.hpp"
#include "io/output/sinks.hpp"
#include "io/results/progress.hpp"
#include "io/results/run_json.hpp"
#include "io/scene/scene.hpp"
#include "kernels/bodies/larger.hpp"
#include "runtime/graph/clock.hpp"
#include "runtime/graph/one_rank.hpp"
#include "runtime/step/dealing.hpp"
#include "runtime/step/simulation.hpp"
#include "runtime/trace/order.hpp"
#include "runtime/trace/task_times.hpp"

namespace talus {

namespace {

/// Set by SIGINT and SIGTERM: the run ends after the step it is in, with all its files whole.
std::atomic<int> stop_signal{0};
static_assert(std::atomic<int>::is_always_lock_free);

extern "C" void request_stop(int signal) {
  stop_signal.store(signal);
}

class Stopwatch {
 public:
  double seconds() const { return std::chrono::duration<double>(graph::Clock::now() - start_).count(); }

 private:
  graph::Clock::time_point start_ = graph::Clock::now();
};

/// When the next frame is due.
class FrameClock {
 public:
  explicit FrameClock(const io::OutputSpec& output) : output_(output) {}

  bool due(const StepReport& report) {
    bool now = false;
    if (output_.every_steps) now |= report.step % *output_.every_steps == 0;
    if (output_.every) {
      const auto passed = static_cast<std::int64_t>(report.time / *output_.every * (1 + 1e-12));
      now |= passed > passed_;
      passed_ = passed;
    }
    return now;
  }

 private:
  const io::OutputSpec& output_;
  std::int64_t passed_ = 0;
};

/// Rows of finished steps on their way to the recorder, which runs on the executor's background thread. Rows
/// go in batches, since a row is less work than handing it over. Frames of several ranks are written by all
/// of them together, between two steps: messages of a background thread would need an order among those of
/// the steps.
class RecorderFeed {
 public:
  RecorderFeed(graph::Executor& executor, io::Recorder& recorder, const graph::Communicator& ranks,
               StepList error_steps)
      : executor_(executor), recorder_(recorder), ranks_(ranks), error_steps_(std::move(error_steps)) {}

  void row(const Simulation& simulation, const std::optional<TriaxialReport>& triaxial) {
    if (ranks_.rank() != 0) return;
    rows_.push_back({simulation.report(), simulation.walls(), triaxial, {}});
    if (error_steps_.contains(simulation.report().step)) rows_.back().errors = simulation.error_history();
    if (rows_.size() >= 64 || since_.seconds() > 0.5) flush();
  }

  void frame(Frame&& frame) {
    flush();
    if (ranks_.ranks() > 1) {
      executor_.drain();
      recorder_.record_frame(std::move(frame));
      return;
    }
    executor_.submit_background("output of a frame", [this, moved = std::move(frame)]() mutable {
      recorder_.record_frame(std::move(moved));
    });
  }

  /// Anything that writes files: one thread at a time may be inside HDF5.
  void later(const char* name, std::function<void()> work) {
    flush();
    executor_.submit_background(name, std::move(work));
  }

  void flush() {
    since_ = {};
    if (rows_.empty()) return;
    executor_.submit_background("output of steps", [this, rows = std::move(rows_)] {
      for (const io::StepRecord& row : rows) recorder_.record_step(row);
      recorder_.flush();
    });
    rows_.clear();
  }

 private:
  graph::Executor& executor_;
  io::Recorder& recorder_;
  const graph::Communicator& ranks_;
  StepList error_steps_;
  std::vector<io::StepRecord> rows_;
  Stopwatch since_;
};

struct Tally {
  std::int64_t unconverged = 0;
  std::int64_t passed = 0;     ///< pairs that went through one another
  std::int64_t stagnated = 0;  ///< steps
  double floor = 0;            ///< worst error at which a step stood still
  std::int64_t iterations = 0;
  double worst_error = 0;
  double worst_balance = 0;
  double worst_penetration = 0;       ///< [smallest radius]
  double exposed = 0, iterating = 0;  ///< [s] waited for messages; in the iterations

  void add(const Simulation& simulation) {
    const StepReport& report = simulation.report();
    exposed += simulation.exposed();
    iterating += simulation.sums().times.iteration;
    iterations += report.iterations;
    if (!report.converged) ++unconverged;
    passed += report.passed;
    if (simulation.iterations().stagnated) {
      ++stagnated;
      floor = std::max(floor, report.error_rms);
    }
    worst_error = larger(worst_error, report.error_rms);
    worst_balance = larger(worst_balance, report.balance);
    worst_penetration = larger(worst_penetration, report.penetration_max);
  }

  void sum_up(const StepReport& last, io::Summary& summary) const {
    summary.steps = last.step;
    summary.time = last.time;
    summary.iterations = iterations;
    summary.unconverged_steps = unconverged;
    summary.converged_steps = last.step - unconverged;
    summary.worst_error_rms = worst_error;
    summary.worst_balance = worst_balance;
    summary.worst_penetration = worst_penetration;
  }
};

std::string counted(std::size_t count, const char* what) {
  return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

std::string contents(const io::Scene& scene, std::size_t grains) {
  return fmt::format("{}, {}, {}", counted(grains, "grain"), counted(scene.setup.walls.size(), "wall"),
                     counted(scene.setup.stages.size(), "stage"));
}

void print_start(const io::Scene& scene, std::size_t grains, int threads, const graph::Communicator& ranks) {
  fmt::print(stderr, "talus: {}, {}\n", scene.name, contents(scene, grains));
  const auto count = [](int n, const char* what) { return counted(static_cast<std::size_t>(n), what); };
  const int cores = omp_get_num_procs();
  fmt::print(stderr, "talus: {}, {} each, {} for this process, MPI threads: {}\n",
             count(ranks.ranks(), "rank"), count(threads, "thread"), count(cores, "core"),
             ranks.thread_level());
  if (scene.setup.decomposition.subdomains > 1 || ranks.ranks() > 1)
    fmt::print(stderr, "talus: {} by {}, {}, {}\n",
               count(std::max(scene.setup.decomposition.subdomains, ranks.ranks()), "subdomain"),
               name_of(scene.setup.decomposition.partitioner),
               couplings().of(scene.setup.decomposition.coupling).name,
               scene.setup.decomposition.exchange == ExchangeScheme::dcs ? "DCS" : "CCS");
  // Ranks that are bound have cores of their own; unbound ones share those of the machine.
  const bool bound = cores < io::collect_provenance().cores_online;
  if (threads * (bound ? 1 : ranks.ranks_on_node()) > cores)
    fmt::print(stderr, "talus: warning: more threads than cores; results are the same, the run is slower\n");
}

/// The signal that any of the ranks received, or 0.
int signal_of(const graph::Communicator& ranks) {
  double signal[1] = {static_cast<double>(stop_signal.load())};
  ranks.max(signal);
  return static_cast<int>(signal[0]);
}

/// Which of its conditions a stage has come to, and how far it was from rest where that was one.
void print_stage_end(const Simulation& simulation) {
  const StageEnd& end = simulation.stage().end;
  fmt::print(stderr, "talus: stage '{}' ended after {}: {} reached{}\n", simulation.stage().name,
             counted(static_cast<std::size_t>(simulation.steps_of_stage()), "step"), simulation.end_reached(),
             end.equilibrium
                 ? fmt::format(", unrest {:.2g} (asked {:.2g})", simulation.unrest(), *end.equilibrium)
                 : "");
}

/// Runs the steps; returns the signal that stopped them, or 0.
int advance(Simulation& simulation, const RunOptions& options, const io::OutputSpec& output,
            const std::string& directory, RecorderFeed& feed, Tally& tally,
            const graph::Communicator& ranks) {
  std::optional<io::Progress> progress;
  if (ranks.rank() == 0) progress.emplace(io::progress_on_stderr());
  FrameClock clock(output);
  const auto write_frame = [&] { feed.frame(simulation.frame(output.contacts)); };
  if (output.stage_frames) write_frame();
  while (!simulation.finished()) {
    const StepReport& report = simulation.step();
    tally.add(simulation);
    feed.row(simulation, simulation.triaxial());
    if (std::count(options.dump_fclib.begin(), options.dump_fclib.end(), report.step) > 0)
      feed.later("dump of a contact problem", fclib_dump(simulation, directory));
    const bool stage_ends = simulation.stage_fraction() >= 1;
    const bool last = options.steps && report.step >= *options.steps;
    const int signal = signal_of(ranks);
    const bool ends = stage_ends || last || signal != 0;
    if (clock.due(report) || (ends && output.stage_frames)) write_frame();
    if (progress) progress->update(report, simulation.stage().name, simulation.stage_fraction());
    if (progress && stage_ends) {
      progress->finish();
      print_stage_end(simulation);
    }
    if (signal != 0) {
      if (progress) progress->finish();
      return signal;
    }
    if (last) break;
    simulation.begin_next_stage();
  }
  if (progress) progress->finish();
  return 0;
}

/// Of earlier runs, that this one goes by; null: not asked for.
struct Recordings {
  std::unique_ptr<trace::Order> order;
  std::unique_ptr<trace::TaskTimes> times;
};

/// What was asked of steps that a run did not come to, and did not need to end well.
void warn_of_unreached(const RunOptions& options, std::int64_t steps) {
  const auto warn = [&](const char* option, const std::string& asked) {
    fmt::print(stderr, "talus: warning: {} {}: the run ended after step {}\n", option, asked, steps);
  };
  if (!options.error_history.empty() && StepList(options.error_history).last() > steps)
    warn("--error-history", options.error_history);
  if (options.trace_steps.empty()) return;
  const StepRange traced = parse_steps(options.trace_steps);
  if ((traced.last == trace::largest_step ? traced.first : traced.last) > steps)
    warn("--trace-steps", options.trace_steps);
}

/// A run that is done may have left something undone: what was asked for, or more that the scene has.
void add_undone(const RunOptions& options, bool scene_ended, io::Summary& summary) {
  std::vector<std::string> undone;
  if (!scene_ended)
    undone.push_back(fmt::format("stopped after {} by --steps; the scene has more",
                                 counted(static_cast<std::size_t>(summary.steps), "step")));
  for (const std::int64_t step : options.dump_fclib)
    if (step > summary.steps) {
      undone.push_back(fmt::format("no dump of step {}: the run ended after step {}", step, summary.steps));
      summary.exit_code = exit_failure;
    }
  summary.message = fmt::format("{}", fmt::join(undone, "; "));
}

void print_notes(const Simulation& simulation, const Tally& tally) {
  const MessageCount& messages = simulation.messages();
  if (messages.messages > 0)
    fmt::print(stderr,
               "talus: an exchange: {} messages of {} bytes between subdomains, {} of {} between ranks; "
               "waiting for them took {:.1f} % of the iterations on rank 0\n",
               messages.messages, messages.bytes, messages.between_ranks, messages.bytes_between_ranks,
               tally.iterating > 0 ? 100 * tally.exposed / tally.iterating : 0.0);
  if (tally.passed > 0)
    fmt::print(stderr,
               "talus: warning: {} times a grain went through what it met, or deep into it, within one step; "
               "these steps count as unconverged. Reduce time_step\n",
               tally.passed);
  if (tally.stagnated > 0)
    fmt::print(stderr,
               "talus: warning: in {} steps the error stood still above the tolerance, at {:.2g} at worst; "
               "more sweeps do not help, so they ended there. Raise solver.tolerance above it, reduce "
               "time_step, or try another solver.method\n",
               tally.stagnated, tally.floor);
}

void fail(io::Summary& summary, const std::exception& error) {
  summary.status = "failed";
  summary.message = error.what();
  summary.exit_code = exit_failure;
  summary.digest.reset();
}

/// Takes the run to its end, or to what breaks it off; the summary says which. Throws what the beginning and
/// the end of a run throw.
void run_steps(const RunOptions& options, const io::Scene& scene, Sample sample, int threads,
               const std::string& directory, const Recordings& recordings, io::Recorder& recorder,
               const graph::Communicator& ranks, io::Summary& summary) {
  Tally tally;
  std::optional<TraceFeed> trace;
  if (options.trace)
    trace.emplace(directory, parse_steps(options.trace_steps), options.trace_own_caches, threads, ranks);
  graph::Executor executor(
      {.threads = threads, .trace = trace ? &trace->recorder() : nullptr, .times = recordings.times.get()});
  if (trace) trace->start(executor);
  Simulation simulation(scene.setup, deal_out(std::move(sample), scene.setup.decomposition, ranks), executor,
                        ranks);
  if (recordings.order) simulation.follow(recordings.order.get());
  RecorderFeed feed(executor, recorder, ranks,
                    options.error_history.empty() ? StepList() : StepList(options.error_history));
  summary.status = "done";
  try {
    if (const int signal = advance(simulation, options, scene.output, directory, feed, tally, ranks);
        signal != 0) {
      summary.status = "stopped";
      summary.message = fmt::format("signal {} after step {}", signal, simulation.report().step);
      summary.exit_code = exit_failure;
    }
  } catch (const std::exception& error) {
    fail(summary, error);
  }
  try {
    feed.flush();
    executor.drain();
  } catch (const std::exception& error) {
    fail(summary, error);
  }
  tally.sum_up(simulation.report(), summary);
  // The other ranks may wait for what will not come: the caller ends them when the files are whole.
  if (summary.status == "failed") return;
  if (trace) trace->finish(executor);
  if (ranks.rank() == 0) print_notes(simulation, tally);
  if (summary.status == "done") {
    if (tally.unconverged > 0 && !scene.setup.allow_unconverged) summary.exit_code = exit_tolerance_missed;
    const bool last_stage = simulation.stage_index() + 1 == scene.setup.stages.size();
    add_undone(options, last_stage && simulation.stage_fraction() >= 1, summary);
    if (ranks.rank() == 0) warn_of_unreached(options, summary.steps);
  }
  summary.digest = simulation.digest();
}

/// The same from the first file of the results to the last, with all that it throws in the summary.
io::Summary simulate(const RunOptions& options, const io::Scene& scene, Sample sample,
                     const std::string& directory, const io::Provenance& provenance,
                     const Recordings& recordings, const graph::Communicator& ranks) {
  const Stopwatch watch;
  io::Summary summary;
  summary.bodies = sample.size();
  // Of one rank it writes on the background thread, from where a trace must hear of no call.
  io::OutputContext context =
      io::output_context(directory, scene.setup, ranks.ranks() > 1 ? ranks : graph::one_rank());
  context.contacts = scene.output.contacts;
  context.provenance = provenance;
  io::Recorder recorder(std::move(context), scene.output.sinks);
  // The first fault is what to mend.
  const auto attempt = [&](const auto& work) {
    try {
      work();
    } catch (const std::exception& error) {
      if (summary.status != "failed") fail(summary, error);
    }
  };
  attempt([&] {
    recorder.open();
    run_steps(options, scene, std::move(sample), provenance.threads, directory, recordings, recorder, ranks,
              summary);
    recorder.close();
  });
  summary.wall_s = watch.seconds();
  summary.frames = recorder.frames();
  attempt([&] { recorder.end(summary); });
  return summary;
}

void print_end(const io::Summary& summary, const SolverSettings& solver, const std::string& directory) {
  if (!summary.message.empty())
    fmt::print(stderr, "talus: {}{}\n",
               summary.exit_code != exit_failure ? ""
               : summary.status == "stopped"     ? "stopped: "
                                                 : "error: ",
               summary.message);
  const std::string digest = summary.digest ? fmt::format(", digest {:016x}", *summary.digest) : "";
  fmt::print(stderr, "talus: {}, {:.6g} s simulated in {:.1f} s, {} sweeps{}\n",
             counted(static_cast<std::size_t>(summary.steps), "step"), summary.time, summary.wall_s,
             summary.iterations, digest);
  if (summary.unconverged_steps > 0)
    fmt::print(
        stderr,
        "talus: {} of {} steps missed the tolerance: worst error {:.2e} (allowed {:.2g}), worst balance "
        "{:.2e} (allowed {:.2g}); `converged` in steps.csv says which. Raise solver.max_iterations, "
        "reduce time_step, or accept them with allow_unconverged = true\n",
        summary.unconverged_steps, summary.steps, summary.worst_error_rms, solver.tolerance,
        summary.worst_balance, solver.balance_tolerance);
  fmt::print(stderr, "talus: results in {}\n", directory);
}

/// What rank 0 alone knows at the start, when it has made the sample: where the walls stand and what they
/// weigh.
void share_walls(Setup& setup, const graph::Communicator& ranks) {
  std::vector<double*> values;
  for (Wall& wall : setup.walls) {
    for (Eigen::Index k = 0; k < 3; ++k) values.push_back(&wall.point[k]);
    values.push_back(&wall.load.mass);
  }
  for (Stage& stage : setup.stages)
    for (auto& [name, load] : stage.loads) values.push_back(&load.mass);
  std::vector<double> own;
  if (ranks.rank() == 0)
    for (const double* value : values) own.push_back(*value);
  const std::vector<double> shared = ranks.gather_records(std::span<const double>(own));
  for (std::size_t k = 0; k < values.size(); ++k) *values[k] = shared[k];
}

/// True when any rank refuses to run: `why` says it for this one, "" when it does not. Rank 0 speaks for all:
/// of itself, or else says each sentence once.
bool any_refused(const std::string& why, const graph::Communicator& ranks) {
  const std::string own = why.empty() ? "" : fmt::format("{} {}", ranks.rank(), why) + '\0';
  const std::vector<char> all = ranks.gather_records(std::span<const char>(own));
  std::istringstream refusals(ranks.rank() == 0 ? std::string(all.begin(), all.end()) : "");
  std::set<std::string> said;
  for (std::string refusal; std::getline(refusals, refusal, '\0');) {
    const std::size_t space = refusal.find(' ');
    const std::string rank = refusal.substr(0, space), sentence = refusal.substr(space + 1);
    if (!said.insert(sentence).second) continue;
    fmt::print(stderr, "talus: error: {}{}\n", rank == "0" ? "" : "rank " + rank + ": ", sentence);
    if (rank == "0") break;
  }
  return !all.empty();
}

/// Ends a run that failed on this rank of several. Rank 0 has tables and run.json to write, in the middle of
/// which it must not be killed: the others wait for it, but not for ever, since it may wait for them. It
/// waits a moment for what they have to say.
[[noreturn]] void end_all(int code, const graph::Communicator& ranks) {
  std::fflush(nullptr);
  ranks.meet(ranks.rank() == 0 ? 1 : 20);
  ranks.abort(code);
  std::exit(code);  // g++ 12 does not see that the virtual call above never returns
}

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

int run_scene(const RunOptions& options, const io::Scene& scene, Sample sample, const Recordings& recordings,
              const graph::Communicator& ranks) {
  const int threads = threads_of(options);
  const std::string directory = options.out.empty() ? scene.output.directory : options.out;
  io::Provenance provenance = io::collect_provenance();
  provenance.threads = threads;
  provenance.simd = name_of(SweepKernels(settled(scene.setup.solver.simd, ranks)).set());
  provenance.command_line = options.command_line;
  provenance.seed = scene.setup.seed;
  provenance.scene_file = scene.source_file;
  std::string refused;
  std::optional<io::DirectoryLock> lock;
  if (ranks.rank() == 0) {
    try {
      lock.emplace(io::prepare_output_directory(directory, options.force, io::is_output_name));
    } catch (const io::FileError& error) {
      refused = error.what();
    }
  }
  if (any_refused(refused, ranks)) return exit_bad_input;
  if (ranks.rank() == 0) {
    io::write_whole(directory + "/scene.resolved.toml", io::resolved_scene(scene));
    print_start(scene, sample.size(), threads, ranks);
  }
  const io::Summary summary =
      simulate(options, scene, std::move(sample), directory, provenance, recordings, ranks);
  if (ranks.rank() == 0) {
    print_end(summary, scene.setup.solver, directory);
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
      if (const std::string overlaps = describe_overlaps(scene, sample); !overlaps.empty())
        fmt::print(stderr, "talus: warning: {}\n", overlaps);
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
  std::signal(SIGINT, request_stop);
  std::signal(SIGTERM, request_stop);
  try {
    return run_scene(options, scene, std::move(sample), recordings, ranks);
  } catch (const std::exception& error) {
    fmt::print(stderr, "talus: error: {}\n", error.what());
    if (ranks.ranks() > 1) end_all(exit_failure, ranks);
    return exit_failure;
  }
}

}  // namespace talus
