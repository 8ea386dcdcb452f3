#include "apps/commands/run_steps.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "apps/commands/dump_fclib.hpp"
#include "apps/commands/recorder_feed.hpp"
#include "apps/commands/run_checkpoints.hpp"
#include "apps/commands/run_findings.hpp"
#include "apps/commands/run_limit.hpp"
#include "apps/commands/run_messages.hpp"
#include "apps/commands/run_status.hpp"
#include "apps/commands/step_list.hpp"
#include "apps/shared/exit_codes.hpp"
#include "apps/shared/signals.hpp"
#include "apps/shared/trace_feed.hpp"
#include "io/output/recorder.hpp"
#include "io/results/progress.hpp"
#include "runtime/graph/clock.hpp"
#include "runtime/graph/one_rank.hpp"
#include "runtime/step/dealing.hpp"
#include "runtime/step/due_clock.hpp"
#include "runtime/step/simulation.hpp"

namespace talus {

namespace {

/// What is asked of a run between two steps, the same on all ranks.
struct Asked {
  int signal = 0;      ///< to end, by a signal
  bool limit = false;  ///< to end, as its time is up
  bool save = false;   ///< for a checkpoint
  bool ends() const { return signal != 0 || limit; }
};

/// Whichever rank got a signal; the clock is that of rank 0. One reduction, of what comes in one message.
Asked agree(const graph::Communicator& ranks, bool limit, bool save) {
  double asked[3] = {static_cast<double>(stop_signal()), limit ? 1.0 : 0.0,
                     save || save_was_asked() ? 1.0 : 0.0};
  ranks.max(asked);
  return {static_cast<int>(asked[0]), asked[1] > 0, asked[2] > 0};
}

/// The progress on stderr and in run.log.
class Lines {
 public:
  explicit Lines(const PreparedRun& run) {
    if (run.ranks.rank() != 0) return;
    if (!run.terminal.quiet()) lines_.push_back(io::progress_on_stderr());
    if (std::FILE* log = run.terminal.log()) lines_.emplace_back(log, false, std::size_t{0});
  }
  void update(const Simulation& simulation) {
    for (io::Progress& line : lines_)
      line.update(simulation.report(), simulation.stage().name, simulation.stage_fraction());
  }
  void finish() {
    for (io::Progress& line : lines_) line.finish();
  }
  /// Once, while the run goes on.
  void tell_cost(const PreparedRun& run, const Simulation& simulation, const Tally& tally) {
    if (lines_.empty() || told_) return;
    const std::string note = note_of_direct_solves(simulation, tally, DirectSolveCost{}.under_way);
    if (note.empty()) return;
    told_ = true;
    finish();
    run.terminal.say("{}", note);
  }

 private:
  std::vector<io::Progress> lines_;
  bool told_ = false;
};

/// The parts of a run that its steps feed.
struct Advance {
  const PreparedRun& run;
  Simulation& simulation;
  RecorderFeed& feed;
  io::Recorder& recorder;
  CheckpointKeeper& keeper;
  RunMemory memory;
  DueClock frames;
  WallLimit limit;
  std::int64_t frames_given;         ///< those before a resumption among them
  std::optional<StatusFile> status;  ///< rank 0's

  /// Frames are counted through all parts of a run, so that the same ones have contacts.
  void write_frame() {
    const io::OutputSpec& output = run.scene.output;
    simulation.release_room();
    feed.frame(simulation.frame(output.contacts && frames_given++ % output.contacts_every == 0));
  }

  /// Where the files of the results are, behind all that steps have given them.
  io::OutputMark mark() {
    feed.drain();
    return recorder.mark();
  }
  bool save(bool counts) {
    simulation.release_room();
    RunMemory now = memory;
    now.mark = mark();
    now.frames_passed = frames.passed();
    now.wall_s += graph::seconds_now() - run.began;
    const bool saved = keeper.save(simulation, std::move(now), counts);
    limit.took_save(keeper.seconds());
    return saved;
  }
};

/// How the steps of a run ended.
struct Stop {
  Asked asked;
  bool saved = false;  ///< a checkpoint of this step is there
};

/// A step, its rows, and what follows from what is asked behind it. True: the run ends here.
bool advance_step(Advance& all, Lines& lines, Stop& stop) {
  const auto& [run, simulation, feed, recorder, keeper, memory, frames, limit, given, status] = all;
  const RunOptions& options = run.options;
  const double before = graph::seconds_now();
  const StepReport& report = simulation.step();
  all.memory.tally.add(simulation);
  feed.row(simulation);
  if (std::count(options.dump_fclib.begin(), options.dump_fclib.end(), report.step) > 0)
    feed.later("dump of a contact problem", fclib_dump(simulation, run.directory));
  const double now = graph::seconds_now();
  all.limit.took_step(now - before);
  all.limit.took_frame(feed.frame_seconds());
  const bool first = run.ranks.rank() == 0;
  const Asked asked = agree(run.ranks, first && limit.reached(now), first && keeper.wall_due(now));
  const bool due = keeper.due(report);
  const bool stage_ends = simulation.stage_fraction() >= 1;
  const bool last = options.steps && report.step >= *options.steps;
  const bool written =
      all.frames.due(report.step, report.time) || (stage_ends && run.scene.output.stage_frames);
  if (written) all.write_frame();
  lines.update(simulation);
  lines.tell_cost(run, simulation, all.memory.tally);
  if (stage_ends) {
    lines.finish();
    if (first) print_stage_end(run.terminal, simulation);
  }
  simulation.begin_next_stage();
  stop.asked = simulation.finished() ? Asked{} : asked;
  const bool ends = simulation.finished() || last || stop.asked.ends();
  const bool counts = due || asked.save;
  if (counts || stop.asked.ends() || (ends && options.resume)) stop.saved = all.save(counts);
  // Where a run stops for good; one that goes on cuts this frame off again, and its time may be up.
  const bool in_haste = stop.asked.ends() && run.granted;
  if (ends && !written && !in_haste && run.scene.output.stage_frames) all.write_frame();
  if (all.status) all.status->update(simulation, memory.tally, keeper, now, ends);
  return ends;
}

/// Runs the steps.
Stop advance(Advance& all) {
  Lines lines(all.run);
  if (!all.run.resume && all.run.scene.output.stage_frames) all.write_frame();
  Stop stop;
  if (const auto& steps = all.run.options.steps; steps && all.simulation.report().step >= *steps) {
    // A run that was killed behind its last checkpoint lacks its end only, and the frame of it.
    const std::vector<double>& times = all.memory.mark.frame_times;
    if (all.run.scene.output.stage_frames && (times.empty() || times.back() != all.simulation.report().time))
      all.write_frame();
    return stop;
  }
  while (!all.simulation.finished()) {
    stop = {};
    if (advance_step(all, lines, stop)) break;
  }
  lines.finish();
  return stop;
}

/// What was asked of steps that a run did not come to, and did not need to end well.
void warn_of_unreached(const Terminal& terminal, const RunOptions& options, std::int64_t steps) {
  const auto warn = [&](const char* option, const std::string& asked) {
    terminal.warn("warning: {} {}: the run ended after step {}", option, asked, steps);
  };
  if (!options.error_history.empty() && StepList(options.error_history).last() > steps)
    warn("--error-history", options.error_history);
  if (options.trace_steps.empty()) return;
  const StepRange traced = parse_steps(options.trace_steps);
  if ((traced.last == trace::largest_step ? traced.first : traced.last) > steps)
    warn("--trace-steps", options.trace_steps);
}

/// A run that is done may have left something undone: what was asked for, or more that the scene has.
void add_undone(const RunOptions& options, const ResumePoint* resume, io::Summary& summary) {
  std::vector<std::string> undone;
  if (resume != nullptr && summary.complete && resume->file.state.head.report.step == summary.steps &&
      std::ranges::any_of(resume->changes, io::moves_an_end))
    undone.push_back(
        fmt::format("no step was made: the run was at the end that it has now, or beyond; it stays at {}",
                    counted(static_cast<std::size_t>(summary.steps), "step")));
  if (!summary.complete)
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

/// The run was stopped: by whom, and whether it can go on.
void note_stop(const Stop& stop, std::int64_t step, io::Summary& summary) {
  summary.status = "stopped";
  summary.message = fmt::format(
      "{} after step {}{}", stop.asked.signal != 0 ? signal_name(stop.asked.signal) : "the time is up", step,
      stop.saved ? "; --resume goes on from there" : ", and no checkpoint could be written");
  summary.exit_code = stop.saved ? exit_stopped : exit_failure;
}

/// At its first step, or where the checkpoint has it.
std::unique_ptr<Simulation> make_simulation(const PreparedRun& run, Sample sample,
                                            std::vector<GivenForce> forces, graph::Executor& executor) {
  const Setup& setup = run.scene.setup;
  if (run.resume) {
    auto simulation = std::make_unique<Simulation>(setup, run.resume->file.state, executor, run.ranks);
    run.resume->file.state.parts = {};  // some 230 bytes a grain
    return simulation;
  }
  auto simulation = std::make_unique<Simulation>(
      setup, deal_out(std::move(sample), setup.decomposition, run.ranks), executor, run.ranks);
  if (run.scene.from_state()) simulation->begin_from(std::move(forces));
  return simulation;
}

/// What the command remembers at its start.
RunMemory first_memory(const PreparedRun& run) {
  if (run.resume) return run.resume->memory;
  RunMemory memory;
  for (const Wall& wall : run.scene.setup.walls)
    memory.wall_points.insert(memory.wall_points.end(), wall.point.begin(), wall.point.end());
  memory.wall_mass = run.wall_mass;
  for (const NamedBody& body : run.scene.setup.named)
    memory.named.push_back(static_cast<std::int64_t>(body.id));
  return memory;
}

/// Takes the run to its end, or to what breaks it off; the summary says which. Throws what the beginning and
/// the end of a run throw.
void run_steps(const PreparedRun& run, Sample sample, std::vector<GivenForce> forces, io::Recorder& recorder,
               io::Summary& summary) {
  const RunOptions& options = run.options;
  const io::Scene& scene = run.scene;
  const Recordings& recordings = run.recordings;
  const graph::Communicator& ranks = run.ranks;
  const Terminal& terminal = run.terminal;
  std::optional<TraceFeed> trace;
  if (options.trace)
    trace.emplace(run.directory, parse_steps(options.trace_steps), options.trace_own_caches,
                  run.provenance.threads, ranks);
  graph::Executor executor({.threads = run.provenance.threads,
                            .trace = trace ? &trace->recorder() : nullptr,
                            .times = recordings.times.get()});
  if (trace) trace->start(executor);
  const std::unique_ptr<Simulation> made =
      make_simulation(run, std::move(sample), std::move(forces), executor);
  Simulation& simulation = *made;
  if (recordings.order) simulation.follow(recordings.order.get());
  RecorderFeed feed(executor, recorder, ranks,
                    options.error_history.empty() ? StepList() : StepList(options.error_history));
  CheckpointKeeper keeper(scene.checkpoint, run.directory,
                          ranks.rank() == 0 ? texts_of(scene, run.resolved, options.overrides)
                                            : std::map<std::string, std::string>(),
                          ranks, terminal);
  const RunMemory memory = first_memory(run);
  keeper.start(memory);
  Advance all{run,
              simulation,
              feed,
              recorder,
              keeper,
              memory,
              DueClock(scene.output.every_steps, scene.output.every, memory.frames_passed),
              WallLimit(run.granted ? std::optional(run.began + *run.granted) : std::nullopt),
              static_cast<std::int64_t>(memory.mark.frame_times.size()),
              {}};
  if (ranks.rank() == 0) all.status.emplace(run.directory);
  summary.status = "done";
  try {
    if (const Stop stop = advance(all); stop.asked.ends()) note_stop(stop, simulation.report().step, summary);
  } catch (const std::exception& error) {
    fail(summary, error);
  }
  try {
    feed.drain();
  } catch (const std::exception& error) {
    fail(summary, error);
  }
  const Tally& tally = all.memory.tally;
  tally.sum_up(simulation.report(), summary);
  summary.wall_s = memory.wall_s;
  summary.bodies_at_end = static_cast<std::size_t>(simulation.bodies());
  // The other ranks may wait for what will not come: the caller ends them when the files are whole.
  if (summary.status == "failed") return;
  if (trace) trace->finish(executor);
  summary.findings = run_findings(simulation, tally);
  if (ranks.rank() == 0) {
    print_notes(terminal, simulation, tally);
    for (const std::string& finding : summary.findings) terminal.warn("warning: {}", finding);
  }
  if (summary.status == "done") {
    if (tally.unconverged > 0 && !scene.setup.allow_unconverged) summary.exit_code = exit_tolerance_missed;
    const bool last_stage = simulation.stage_index() + 1 == scene.setup.stages.size();
    summary.complete = last_stage && simulation.stage_fraction() >= 1;
    add_undone(options, run.resume, summary);
    if (ranks.rank() == 0) warn_of_unreached(terminal, options, summary.steps);
  }
  summary.digest = simulation.digest();
}

/// With how many grains the run began: those that are there, without those that came, with those that went.
std::size_t first_bodies(const CheckpointHead& head) {
  std::int64_t bodies = head.size.bodies;
  for (const std::int64_t placed : head.population.placed) bodies -= placed;
  for (const std::int64_t removed : head.population.removed) bodies += removed;
  return static_cast<std::size_t>(bodies);
}

/// Of the heaviest grains, in the strongest gravity of a stage [N/m^3].
double grain_weight(const io::Scene& scene) {
  double density = scene.density, gravity = 0;
  for (const io::MaterialSpec& material : scene.materials) density = std::max(density, material.density);
  for (const Stage& stage : scene.setup.stages) gravity = std::max(gravity, stage.gravity.norm());
  return density * gravity;
}

}  // namespace

io::Summary simulate(const PreparedRun& run, Sample sample, std::vector<GivenForce> forces) {
  io::Summary summary;
  summary.bodies = run.resume ? first_bodies(run.resume->file.state.head) : sample.size();
  summary.warnings = run.warnings;
  // Of one rank it writes on the background thread, from where a trace must hear of no call.
  io::OutputContext context = io::output_context(run.directory, run.scene.setup,
                                                 run.ranks.ranks() > 1 ? run.ranks : graph::one_rank());
  context.contacts = run.scene.output.contacts;
  context.format = run.scene.output.format;
  context.load.weight = grain_weight(run.scene);
  context.tables_every = run.scene.output.tables_every;
  context.provenance = run.provenance;
  context.begun = summary;  // a killed run leaves it to the one that goes on
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
    if (run.resume)
      recorder.resume(run.resume->memory.mark);
    else
      recorder.open();
    run_steps(run, std::move(sample), std::move(forces), recorder, summary);
    recorder.close();
  });
  summary.wall_s += graph::seconds_now() - run.began;
  summary.frames = recorder.frames();
  attempt([&] { recorder.end(summary); });
  return summary;
}

}  // namespace talus
