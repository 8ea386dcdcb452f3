#include <hdf5.h>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>

#include "apps/commands/partition_command.hpp"
#include "apps/commands/plan.hpp"
#include "apps/commands/replay_command.hpp"
#include "apps/commands/run.hpp"
#include "apps/commands/solve.hpp"
#include "apps/commands/trace_command.hpp"
#include "apps/shared/exit_codes.hpp"
#include "apps/shared/options.hpp"
#include "apps/study_error/study_error.hpp"
#include "apps/study_scaling/study_scaling.hpp"
#include "apps/study_stability/study_stability.hpp"
#include "io/results/version.hpp"
#include "io/scene/detail/spelling.hpp"
#include "io/scene/scene.hpp"
#include "partition/partitioners.hpp"
#include "runtime/graph/clock.hpp"
#include "runtime/graph/mpi_communicator.hpp"
#include "runtime/step/methods/method.hpp"

#include <cstdio>
#include <cstdlib>
#include <utility>

namespace {

void add_threads(CLI::App& app, int& threads) {
  app.add_option("--threads", threads, "threads [one per core]")
      ->type_name("N")
      ->check(talus::thread_count());
}

/// The commands of `app` as far as they were recognised, "talus study error", and the last of them.
std::pair<std::string, const CLI::App*> recognised(const CLI::App* app) {
  std::string command = "talus";
  while (!app->get_subcommands().empty()) {
    app = app->get_subcommands().front();
    command += " " + app->get_name();
  }
  return {command, app};
}

/// What is wrong with the command line, and where to read what is right.
std::string failure_message(const CLI::App* of, const CLI::Error& error) {
  const auto [command, app] = recognised(of);
  std::string what = error.what();
  // CLI11 misses a command before it looks at the word that stands in its place.
  if (const auto words = app->remaining(); error.get_name() == "RequiredError" && !words.empty()) {
    std::vector<std::string> known;
    for (const CLI::App* each : app->get_subcommands({})) known.push_back(each->get_name());
    if (!known.empty())
      what = fmt::format("'{}' is no command of {}{}", words.front(), command,
                         talus::io::detail::hint(words.front(), known));
  }
  return fmt::format("talus: error: {}; `{} --help` lists what there is\n", what, command);
}

/// From "KIND=X", each.
void set_speeds(const std::vector<std::string>& given, talus::trace::Machine& machine) {
  for (const std::string& text : given) {
    const std::size_t sign = text.find('=');
    double speed = 0;
    if (sign == std::string::npos || !CLI::detail::lexical_cast(text.substr(sign + 1), speed))
      throw CLI::ValidationError("--speed-of", "'" + text + "' is not KIND=X, as in glue=3");
    machine.speed_of[text.substr(0, sign)] = speed;
  }
}

void add_machine_options(CLI::App& app, talus::ReplayOptions& replay) {
  app.add_option("--ranks", replay.ranks, "ranks [as recorded]")->type_name("R");
  app.add_option("--threads", replay.threads, "threads of a rank [as recorded]")
      ->type_name("T")
      ->check(talus::thread_count());
  app.add_option("--map", replay.map, "subdomains to ranks: block, cyclic or weight [as recorded]");
  app.add_option("--schedule", replay.schedule, "fixed, as the program does it, or list")
      ->capture_default_str();
  app.add_option("--latency", replay.machine.latency, "of a message between nodes [s]")
      ->capture_default_str();
  app.add_option("--bandwidth", replay.machine.bandwidth, "of a node's link, each way [B/s]")
      ->capture_default_str();
  app.add_option("--overhead", replay.machine.overhead, "of a thread per message sent or taken [s]")
      ->capture_default_str();
  app.add_option("--ranks-per-node", replay.ranks_per_node, "ranks that share a link [1; all as recorded]");
  app.add_option("--node-latency", replay.node_latency,
                 "of a message inside a node [s] [as recorded, or 5e-7]");
  app.add_option("--node-bandwidth", replay.machine.node_bandwidth, "of a message inside a node [B/s]")
      ->capture_default_str();
  app.add_option("--line", replay.machine.line, "to hand a cache line to another core [s]")
      ->capture_default_str();
  app.add_option("--noise", replay.machine.noise, "each task takes up to this part longer")
      ->capture_default_str();
  app.add_option("--seed", replay.machine.seed, "of the noise")->capture_default_str();
  app.add_option("--speed", replay.machine.speed, "of a core, relative to the recorded one")
      ->capture_default_str();
  app.add_option_function<std::vector<std::string>>(
         "--speed-of",
         [&replay](const std::vector<std::string>& given) { set_speeds(given, replay.machine); },
         "the same for one kind of tasks, instead: glue=3")
      ->type_name("KIND=X");
  app.add_option("--contacts-scale", replay.machine.contacts,
                 "contacts per subdomain, relative to the recorded ones")
      ->capture_default_str();
  app.add_option("--steps", replay.steps, "extrapolate the makespan to so many steps");
  app.add_flag(
      "--typical", replay.machine.typical,
      "tasks that took over three times their median of the step take the median: for noisy recordings");
  app.add_option(
      "--quantile", replay.machine.quantile,
      "tasks take this quantile of their times in the step: for recordings on a busy machine [off]");
  app.add_flag("--blocking-check", replay.blocking_check, "convergence checks wait for their sums");
  app.add_option("--smpi-platform", replay.smpi_platform,
                 "write the machine for smpirun, which runs the real program on it (preset smpi)")
      ->type_name("FILE");
  app.add_option("-o,--out", replay.out, "write what would have been, as a trace")->type_name("FILE");
  app.add_flag("--force", replay.force, "replace these files where they are there");
}

}  // namespace

int main(int argc, char** argv) {
  using namespace talus;
  // After a write that failed (a full disk) the library's clean-up at exit crashes, and would turn exit code
  // 1 into a signal; every file is closed where it is written.
  H5dont_atexit();
  CLI::App app{"Talus: dense granular matter by nonsmooth contact dynamics"};
  app.set_version_flag("--version", "talus " + io::version());
  app.require_subcommand(1);
  app.footer(
      "Exit codes: 0 done; 1 failed, or stopped by a signal; 2 bad input, nothing was written; 3 done, but "
      "a\n"
      "step or problem missed its tolerance. First run: docs/tutorial.md; files it leaves: docs/formats.md");
  app.failure_message(failure_message);

  RunOptions run;
  run.command_line.assign(argv, argv + argc);
  CLI::App* run_app = app.add_subcommand("run", "simulate a scene and write its results");
  run_app->add_option("scene", run.scene, "scene file (docs/scenes.md)")->type_name("FILE")->required();
  run_app->add_option("--out", run.out, "directory of the results [the scene's output.directory]")
      ->type_name("DIR");
  run_app->add_flag("--force", run.force, "replace earlier results in the directory");
  run_app->add_option("--steps", run.steps, "stop after so many time steps")->type_name("N");
  add_threads(*run_app, run.threads);
  run_app->add_option("--set", run.overrides, "override a key of the scene, may be repeated")
      ->type_name("a.b=c")
      ->allow_extra_args(false);
  run_app
      ->add_option("--error-history", run.error_history,
                   "steps whose errors go to error_history.csv at every check: 7, 10:20, 1,5,100:120")
      ->type_name("STEPS");
  run_app
      ->add_option(
          "--dump-fclib", run.dump_fclib,
          "write the contact problem of this step, of step 12 to fclib_000012.hdf5 in the results, may be "
          "repeated")
      ->type_name("STEP")
      ->allow_extra_args(false)
      ->check(above_zero());
  CLI::Option* const trace_flag = run_app->add_flag(
      "--trace", run.trace, "record every task into trace.h5 (`talus trace`, `talus replay`)");
  run_app->add_option("--trace-steps", run.trace_steps, "record these steps only")
      ->type_name("FIRST:LAST")
      ->needs(trace_flag);
  run_app
      ->add_flag("--trace-own-caches", run.trace_own_caches,
                 "of one rank, --threads 1: bring in a subdomain's data before its tasks, so that they take "
                 "as long as on a core that has no other subdomain: for replay on as many cores as there "
                 "are subdomains")
      ->needs(trace_flag);
  run_app->add_option("--replay-order", run.replay_order, "begin the loop's tasks in the order of this trace")
      ->type_name("FILE");
  if (graph::simulated_ranks)
    run_app
        ->add_option(
            "--task-times", run.task_times,
            "in the steps of this trace, tasks take their medians in it instead of what this host needs")
        ->type_name("FILE");
  run_app->add_flag("--dry-run", run.dry_run, "check everything, print the resolved scene, write nothing");

  PlanOptions plan;
  CLI::App* plan_app = app.add_subcommand("plan", "say what a scene needs and what is left out");
  plan_app->add_option("scene", plan.scene, "scene file")->type_name("FILE")->required();
  add_threads(*plan_app, plan.threads);
  plan_app->add_flag("--measure", plan.measure, "measure what each omission saves, on the scene's sample");
  plan_app->add_option("--set", plan.overrides, "override a key of the scene, may be repeated")
      ->type_name("a.b=c")
      ->allow_extra_args(false);

  PartitionCommandOptions partition;
  CLI::App* partition_app = app.add_subcommand(
      "partition", "cut a scene's sample into subdomains: loads and interfaces of each partitioner");
  partition_app->add_option("scene", partition.scene, "scene file")->type_name("FILE")->required();
  partition_app->add_option("--subdomains", partition.subdomains, "number of subdomains")
      ->type_name("N")
      ->required()
      ->check(CLI::Range(1, most_subdomains));
  partition_app
      ->add_option(
          "--partitioner", partition.partitioners,
          fmt::format("{}, may be repeated [all but auto]", fmt::join(partitioner_registry().names(), ", ")))
      ->type_name("NAME")
      ->allow_extra_args(false);
  partition_app->add_option("--out", partition.out, "directory of the files [out/partition-NAME]")
      ->type_name("DIR");
  partition_app->add_flag("--force", partition.force, "replace earlier partitions in the directory");
  add_threads(*partition_app, partition.threads);
  partition_app->add_option("--set", partition.overrides, "override a key of the scene, may be repeated")
      ->type_name("a.b=c")
      ->allow_extra_args(false);

  SolveOptions solve;
  CLI::App* solve_app =
      app.add_subcommand("solve", "solve contact problems of FCLIB files: a line, or a table for a folder");
  solve_app
      ->add_option("file", solve.path, "HDF5 file with /fclib_local or /fclib_global, or a folder of them")
      ->type_name("FILE|DIR")
      ->required();
  solve_app
      ->add_option("--method", solve.method, "nlgs, nlgs+momentum, nncg, admm, newton, auto, or all of them")
      ->type_name("NAME")
      ->capture_default_str();
  solve_app->add_option("--tol", solve.tol, "tolerance on the error")
      ->capture_default_str()
      ->check(above_zero());
  solve_app
      ->add_option(
          "--measure", solve.measure,
          "error that --tol is asked of: siconos (fc3d_compute_error), scaled (free of units), or the "
          "larger of the two")
      ->type_name("NAME")
      ->capture_default_str();
  solve_app->add_option("--max-seconds", solve.max_seconds, "give a solve up after so many seconds")
      ->capture_default_str()
      ->check(above_zero());
  solve_app->add_option("--repeat", solve.repeat, "solve each problem so often and tell the median time")
      ->type_name("N")
      ->capture_default_str()
      ->check(above_zero());
  solve_app->add_option("--out", solve.out, "write /solution into a copy of the file")->type_name("FILE");
  solve_app->add_option("--csv", solve.csv, "write the table to a file")->type_name("FILE");
  solve_app->add_option("--profile", solve.profile, "write the performance profile of the methods to a file")
      ->type_name("FILE");
  solve_app->add_flag("--force", solve.force, "replace these files where they are there");

  TraceShowOptions show;
  CLI::App* trace_app = app.add_subcommand("trace", "look at what `talus run --trace` recorded");
  trace_app->require_subcommand(1);
  CLI::App* show_app = trace_app->add_subcommand("show", "say where the time went");
  show_app->add_option("file", show.file, "trace.h5 of a run")->type_name("FILE")->required();

  TraceExportOptions trace_export;
  CLI::App* export_app =
      trace_app->add_subcommand("export", "write it for Perfetto or ViTE, or as a picture");
  export_app->add_option("file", trace_export.file, "trace.h5 of a run")->type_name("FILE")->required();
  export_app->add_option("--format", trace_export.format, "perfetto, paje or svg")->required();
  export_app->add_option("--step", trace_export.step, "this step only [svg: the middle one]");
  export_app->add_option("--iteration", trace_export.iteration, "this iteration of the step only");
  export_app->add_option("-o,--out", trace_export.out, "file [the trace's name, .pftrace, .paje or .svg]")
      ->type_name("FILE");
  export_app->add_flag("--force", trace_export.force, "replace the file where it is there");

  ReplayOptions replay;
  CLI::App* replay_app =
      app.add_subcommand("replay", "play a trace on another machine: what a run there would take");
  replay_app->add_option("file", replay.file, "trace.h5 of a run")->type_name("FILE")->required();
  add_machine_options(*replay_app, replay);
  CLI::App* study_app = app.add_subcommand("study", "measure how well and how fast scenes are solved");
  study_app->require_subcommand(1);
  StudyErrorOptions study_error;
  CLI::App* study_error_app = add_study_error(*study_app, study_error);
  StudyScalingOptions study_scaling;
  CLI::App* study_scaling_app = add_study_scaling(*study_app, study_scaling);
  StabilityOptions stability;
  CLI::App* stability_app = study_app->add_subcommand(
      "stability", "stiff and extreme scenes with known answers: true errors against certificates");
  stability_app->add_option("--only", stability.only, "scenes with this in their name, may be repeated [all]")
      ->type_name("NAME")
      ->allow_extra_args(false);
  stability_app
      ->add_option_function<std::string>(
          "--method",
          [&](const std::string& name) { stability.settings.method = methods().named(name).kind; },
          "solver.method of every scene")
      ->check(CLI::IsMember(methods().names()))
      ->type_name(fmt::format("{}", fmt::join(methods().names(), "|")));
  stability_app
      ->add_option("--tolerance", stability.settings.tolerance,
                   "solver.tolerance of every scene, balance_tolerance 50 times as much [the default ones]")
      ->type_name("T")
      ->check(above_zero());
  stability_app
      ->add_option("--seconds", stability.settings.seconds, "a scene is stopped after so many seconds")
      ->capture_default_str()
      ->check(above_zero());
  stability_app->add_option("--out", stability.out, "directory of the files [out/study-stability]")
      ->type_name("DIR");
  stability_app->add_flag("--force", stability.force, "replace earlier results in the directory");
  stability_app->add_flag("--list", stability.list, "print the names of the scenes, run nothing");

  CLI::App* reference_app =
      app.add_subcommand("scene-reference", "print docs/scenes.md: every key of a scene file");

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? exit_done : exit_bad_input;
  }
  if (*run_app) {
    const graph::MpiSession session(&argc, &argv);
    double delay = 0;  // a slow network on one machine, for tests and benchmarks
    if (const char* seconds = std::getenv("TALUS_MESSAGE_DELAY")) delay = std::atof(seconds);
    const auto ranks = graph::make_communicator(session, {.delay = delay});
    return run_command(run, *ranks);
  }
  if (*plan_app) {
    const graph::MpiSession session(&argc, &argv, plan.measure);  // what messages cost is measured with MPI
    const auto ranks = plan.measure ? graph::plain_mpi(session) : graph::make_communicator(session);
    return plan_command(plan, *ranks);
  }
  if (*partition_app) return partition_command(partition);
  if (*solve_app) return solve_command(solve);
  if (*show_app) return trace_show_command(show);
  if (*export_app) return trace_export_command(trace_export);
  if (*replay_app) return replay_command(std::move(replay));
  if (*study_error_app) return study_error_command(study_error);
  if (*study_scaling_app) return study_scaling_command(study_scaling);
  if (*stability_app) return stability_command(stability);
  if (*reference_app) std::fputs(io::scene_reference().c_str(), stdout);
  return exit_done;
}
