#include "apps/commands/commands.hpp"

#include "apps/commands/solve.hpp"
#include "apps/shared/options.hpp"

namespace talus {

namespace {

void add_options(CLI::App& app, SolveOptions& options) {
  app.add_option("file", options.path, "HDF5 file with /fclib_local or /fclib_global, or a folder of them")
      ->type_name("FILE|DIR")
      ->required();
  app.add_option("--method", options.method, "nlgs, nlgs+momentum, nncg, admm, newton, auto, or all of them")
      ->type_name("NAME")
      ->capture_default_str();
  app.add_option("--tol", options.tol, "tolerance on the error")->capture_default_str()->check(above_zero());
  app.add_option("--measure", options.measure,
                 "error that --tol is asked of: siconos (fc3d_compute_error), scaled (free of units), or the "
                 "larger of the two")
      ->type_name("NAME")
      ->capture_default_str();
  app.add_option("--max-seconds", options.max_seconds, "give a solve up after so many seconds")
      ->capture_default_str()
      ->check(above_zero());
  app.add_option("--repeat", options.repeat, "solve each problem so often and tell the median time")
      ->type_name("N")
      ->capture_default_str()
      ->check(above_zero());
  app.add_option("--out", options.out, "write /solution into a copy of the file")->type_name("FILE");
  app.add_option("--csv", options.csv, "write the table to a file")->type_name("FILE");
  app.add_option("--profile", options.profile, "write the performance profile of the methods to a file")
      ->type_name("FILE");
  app.add_flag("--force", options.force, "replace these files where they are there");
}

}  // namespace

Command solve_entry() {
  return command<SolveOptions>(
      "solve", "solve contact problems of FCLIB files: a line, or a table for a folder", add_options,
      [](SolveOptions& options, CommandLine) { return solve_command(options); });
}

}  // namespace talus
