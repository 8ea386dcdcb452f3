#include <hdf5.h>

#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "apps/exit_codes.hpp"
#include "apps/partition_command.hpp"
#include "apps/plan.hpp"
#include "apps/run.hpp"
#include "apps/solve.hpp"
#include "apps/study_stability.hpp"
#include "io/scene.hpp"
#include "io/version.hpp"

#include <cstdio>
#include <cstdlib>
#include <map>

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
  app.failure_message([](const CLI::App* of, const CLI::Error& error) {
    std::string command = "talus";
    for (const CLI::App* chosen : of->get_subcommands()) command += " " + chosen->get_name();
    return fmt::format("talus: error: {}; `{} --help` lists what there is\n", error.what(), command);
  });

  RunOptions run;
  run.command_line.assign(argv, argv + argc);
  CLI::App* run_app = app.add_subcommand("run", "simulate a scene and write its results");
  run_app->add_option("scene", run.scene, "scene file (docs/scenes.md)")->type_name("FILE")->required();
  run_app->add_option("--out", run.out, "directory of the results [the scene's output.directory]")
      ->type_name("DIR");
  run_app->add_flag("--force", run.force, "replace earlier results in the directory");
  run_app->add_option("--steps", run.steps, "stop after so many time steps")->type_name("N");
  run_app->add_option("--threads", run.threads, "threads [one per core]")
      ->type_name("N")
      ->check(CLI::PositiveNumber);
  run_app->add_option("--set", run.overrides, "override a key of the scene, may be repeated")
      ->type_name("a.b=c")
      ->allow_extra_args(false);
  run_app
      ->add_option(
          "--dump-fclib", run.dump_fclib,
          "write the contact problem of this step to fclib_STEP.hdf5 in the results, may be repeated")
      ->type_name("STEP")
      ->allow_extra_args(false)
      ->check(CLI::PositiveNumber);
  run_app->add_flag("--dry-run", run.dry_run, "check everything, print the resolved scene, write nothing");

  PlanOptions plan;
  CLI::App* plan_app = app.add_subcommand("plan", "say what a scene needs and what is left out");
  plan_app->add_option("scene", plan.scene, "scene file")->type_name("FILE")->required();
  plan_app->add_option("--threads", plan.threads, "threads [one per core]")
      ->type_name("N")
      ->check(CLI::PositiveNumber);
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
      ->check(CLI::Range(1, 65536));
  partition_app
      ->add_option("--partitioner", partition.partitioners,
                   "boxes, fitted, rcb, metis or auto, may be repeated [all but auto]")
      ->type_name("NAME")
      ->allow_extra_args(false);
  partition_app->add_option("--out", partition.out, "directory of the files [out/partition-NAME]")
      ->type_name("DIR");
  partition_app->add_flag("--force", partition.force, "replace earlier partitions in the directory");
  partition_app->add_option("--threads", partition.threads, "threads [one per core]")
      ->type_name("N")
      ->check(CLI::PositiveNumber);
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
      ->check(CLI::PositiveNumber);
  solve_app
      ->add_option(
          "--measure", solve.measure,
          "error that --tol is asked of: siconos (fc3d_compute_error), scaled (free of units), or the "
          "larger of the two")
      ->type_name("NAME")
      ->capture_default_str();
  solve_app->add_option("--max-seconds", solve.max_seconds, "give a solve up after so many seconds")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  solve_app->add_option("--repeat", solve.repeat, "solve each problem so often and tell the median time")
      ->type_name("N")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  solve_app->add_option("--out", solve.out, "write /solution into a copy of the file")->type_name("FILE");
  solve_app->add_option("--csv", solve.csv, "write the table to a file")->type_name("FILE");
  solve_app->add_option("--profile", solve.profile, "write the performance profile of the methods to a file")
      ->type_name("FILE");

  CLI::App* study_app = app.add_subcommand("study", "measure Talus itself");
  study_app->require_subcommand(1);
  StabilityOptions stability;
  CLI::App* stability_app = study_app->add_subcommand(
      "stability", "stiff and extreme scenes with known answers: true errors against certificates");
  stability_app->add_option("--only", stability.only, "scenes with this in their name, may be repeated [all]")
      ->type_name("NAME")
      ->allow_extra_args(false);
  stability_app->add_option("--method", stability.settings.method, "solver.method of every scene")
      ->type_name("auto|nlgs|nlgs+momentum|nncg|admm")
      ->transform(CLI::CheckedTransformer(
          std::map<std::string, SolverMethod>{{"auto", SolverMethod::automatic},
                                              {"nlgs", SolverMethod::nlgs},
                                              {"nlgs+momentum", SolverMethod::momentum},
                                              {"nncg", SolverMethod::nncg},
                                              {"admm", SolverMethod::admm}}));
  stability_app
      ->add_option("--tolerance", stability.settings.tolerance,
                   "solver.tolerance of every scene, balance_tolerance 50 times as much [the default ones]")
      ->type_name("T")
      ->check(CLI::PositiveNumber);
  stability_app
      ->add_option("--seconds", stability.settings.seconds, "a scene is stopped after so many seconds")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
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
    const graph::Communicator ranks(session, {.delay = delay});
    return run_command(run, ranks);
  }
  if (*plan_app) return plan_command(plan);
  if (*partition_app) return partition_command(partition);
  if (*solve_app) return solve_command(solve);
  if (*stability_app) return stability_command(stability);
  if (*reference_app) std::fputs(io::scene_reference().c_str(), stdout);
  return exit_done;
}
