#include "apps/commands/run_steps.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <exception>
#include <optional>
#include <utility>
#include <vector>

#include "apps/commands/dump_fclib.hpp"
#include "apps/commands/recorder_feed.hpp"
#include "apps/commands/run_messages.hpp"
#include "apps/commands/step_list.hpp"
#include "apps/shared/exit_codes.hpp"
#include "apps/shared/trace_feed.hpp"
#include "io/output/recorder.hpp"
#include "io/results/progress.hpp"
#include "runtime/graph/clock.hpp"
#include "runtime/graph/one_rank.hpp"
#include "runtime/step/dealing.hpp"
#include "runtime/step/simulation.hpp"

namespace talus {

namespace {

/// Set by SIGINT and SIGTERM: the run ends after the step it is in, with all its files whole.
std::atomic<int> stop_signal{0};
static_assert(std::atomic<int>::is_always_lock_free);

extern "C" void request_stop(int signal) {
  stop_signal.store(signal);
}

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

/// The signal that any of the ranks received, or 0.
int signal_of(const graph::Communicator& ranks) {
  double signal[1] = {static_cast<double>(stop_signal.load())};
  ranks.max(signal);
  return static_cast<int>(signal[0]);
}

/// Runs the steps; returns the signal that stopped them, or 0.
int advance(const PreparedRun& run, Simulation& simulation, RecorderFeed& feed, Tally& tally) {
  const io::OutputSpec& output = run.scene.output;
  const RunOptions& options = run.options;
  std::optional<io::Progress> progress;
  if (run.ranks.rank() == 0) progress.emplace(io::progress_on_stderr());
  FrameClock clock(output);
  const auto write_frame = [&] { feed.frame(simulation.frame(output.contacts)); };
  if (output.stage_frames) write_frame();
  while (!simulation.finished()) {
    const StepReport& report = simulation.step();
    tally.add(simulation);
    feed.row(simulation, simulation.triaxial());
    if (std::count(options.dump_fclib.begin(), options.dump_fclib.end(), report.step) > 0)
      feed.later("dump of a contact problem", fclib_dump(simulation, run.directory));
    const bool stage_ends = simulation.stage_fraction() >= 1;
    const bool last = options.steps && report.step >= *options.steps;
    const int signal = signal_of(run.ranks);
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

void fail(io::Summary& summary, const std::exception& error) {
  summary.status = "failed";
  summary.message = error.what();
  summary.exit_code = exit_failure;
  summary.digest.reset();
}

/// Takes the run to its end, or to what breaks it off; the summary says which. Throws what the beginning and
/// the end of a run throw.
void run_steps(const PreparedRun& run, Sample sample, io::Recorder& recorder, io::Summary& summary) {
  const auto& [options, scene, recordings, ranks, directory, provenance, warnings] = run;
  Tally tally;
  std::optional<TraceFeed> trace;
  if (options.trace)
    trace.emplace(directory, parse_steps(options.trace_steps), options.trace_own_caches, provenance.threads,
                  ranks);
  graph::Executor executor({.threads = provenance.threads,
                            .trace = trace ? &trace->recorder() : nullptr,
                            .times = recordings.times.get()});
  if (trace) trace->start(executor);
  Simulation simulation(scene.setup, deal_out(std::move(sample), scene.setup.decomposition, ranks), executor,
                        ranks);
  if (recordings.order) simulation.follow(recordings.order.get());
  RecorderFeed feed(executor, recorder, ranks,
                    options.error_history.empty() ? StepList() : StepList(options.error_history));
  summary.status = "done";
  try {
    if (const int signal = advance(run, simulation, feed, tally); signal != 0) {
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

}  // namespace

void stop_on_signals() {
  std::signal(SIGINT, request_stop);
  std::signal(SIGTERM, request_stop);
}

io::Summary simulate(const PreparedRun& run, Sample sample) {
  const double begin = graph::seconds_now();
  io::Summary summary;
  summary.bodies = sample.size();
  summary.warnings = run.warnings;
  // Of one rank it writes on the background thread, from where a trace must hear of no call.
  io::OutputContext context = io::output_context(run.directory, run.scene.setup,
                                                 run.ranks.ranks() > 1 ? run.ranks : graph::one_rank());
  context.contacts = run.scene.output.contacts;
  context.provenance = run.provenance;
  io::Recorder recorder(std::move(context), run.scene.output.sinks);
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
    run_steps(run, std::move(sample), recorder, summary);
    recorder.close();
  });
  summary.wall_s = graph::seconds_now() - begin;
  summary.frames = recorder.frames();
  attempt([&] { recorder.end(summary); });
  return summary;
}

}  // namespace talus
