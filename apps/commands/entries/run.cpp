#include "apps/commands/commands.hpp"

#include <fmt/format.h>

#include <cstdlib>

#include "apps/commands/run.hpp"
#include "apps/commands/threads.hpp"
#include "apps/shared/options.hpp"
#include "runtime/graph/clock.hpp"
#include "runtime/graph/mpi_communicator.hpp"

namespace talus {

namespace {

void add_options(CLI::App& app, RunOptions& options) {
  app.add_option("scene", options.scene, "scene file (docs/scenes.md)")->type_name("FILE")->required();
  app.add_option("--out", options.out, "directory of the results [the scene's output.directory]")
      ->type_name("DIR");
  app.add_flag("--force", options.force, "replace earlier results in the directory");
  app.add_flag("--resume", options.resume,
               "go on from the last checkpoint in the directory, or begin anew where there is none");
  app.add_option("--max-walltime", options.max_walltime,
                 "write a checkpoint and end before so much time has passed, 3:50:00")
      ->type_name("H:MM:SS");
  app.add_option("--steps", options.steps, "stop after so many time steps")->type_name("N");
  app.add_flag("--quiet", options.quiet, "say nothing on stderr but warnings and errors; run.log has it all");
  add_threads(app, options.threads, fmt::format("one per core and {} grains", grains_per_thread));
  add_overrides(app, options.overrides);
  app.add_option("--error-history", options.error_history,
                 "steps whose errors go to error_history.csv at every check: 7, 10:20, 1,5,100:120")
      ->type_name("STEPS");
  app.add_option(
         "--dump-fclib", options.dump_fclib,
         "write the contact problem of this step, of step 12 to fclib_000012.hdf5 in the results, may be "
         "repeated")
      ->type_name("STEP")
      ->allow_extra_args(false)
      ->check(above_zero());
  CLI::Option* const trace_flag = app.add_flag(
      "--trace", options.trace, "record every task into trace.h5 (`talus trace`, `talus replay`)");
  app.add_option("--trace-steps", options.trace_steps, "record these steps only")
      ->type_name("FIRST:LAST")
      ->needs(trace_flag);
  app.add_flag("--trace-own-caches", options.trace_own_caches,
               "of one rank, --threads 1: bring in a subdomain's data before its tasks, so that they take "
               "as long as on a core that has no other subdomain: for replay on as many cores as there "
               "are subdomains")
      ->needs(trace_flag);
  app.add_option("--replay-order", options.replay_order, "begin the loop's tasks in the order of this trace")
      ->type_name("FILE");
  if (graph::simulated_ranks)
    app.add_option(
           "--task-times", options.task_times,
           "in the steps of this trace, tasks take their medians in it instead of what this host needs")
        ->type_name("FILE");
  app.add_flag("--dry-run", options.dry_run, "check everything, print the resolved scene, write nothing");
}

int run(RunOptions& options, CommandLine line) {
  options.command_line.assign(line.argv, line.argv + line.argc);
  const graph::MpiSession session(&line.argc, &line.argv);
  double delay = 0;  // a slow network on one machine, for tests and benchmarks
  if (const char* seconds = std::getenv("TALUS_MESSAGE_DELAY")) delay = std::atof(seconds);
  const auto ranks = graph::make_communicator(session, {.delay = delay});
  return run_command(options, *ranks);
}

}  // namespace

Command run_entry() {
  return command<RunOptions>("run", "simulate a scene and write its results", add_options, run);
}

}  // namespace talus
