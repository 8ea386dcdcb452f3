#include "apps/validate/validate.hpp"

#include "apps/commands/commands.hpp"
#include "apps/shared/options.hpp"

namespace talus {

namespace {

void add_options(CLI::App& app, ValidateOptions& options) {
  app.add_option("cases", options.only, "cases to run [all]")->type_name("CASE");
  app.add_flag("--short", options.effort.brief, "small samples, wide bands: the set of the tests");
  app.add_option("--seeds", options.effort.seeds, "runs of each kind, with grains at other places")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000));
  app.add_option("--size", options.effort.size, "factor on the numbers of grains")
      ->capture_default_str()
      ->check(above_zero());
  app.add_option("--tolerance", options.effort.tolerance, "solver.tolerance")
      ->capture_default_str()
      ->check(above_zero());
  app.add_option("--threads", options.effort.threads, "threads of a run")
      ->capture_default_str()
      ->check(CLI::Range(1, 1024));
  app.add_option("--out", options.out, "directory of the files [out/validate]")->type_name("DIR");
  app.add_flag("--force", options.force, "replace earlier results in the directory");
  app.add_flag("--list", options.list, "print the cases, run nothing");
}

}  // namespace

Command validate_entry() {
  return command<ValidateOptions>(
      "validate", "periodic cells beside closed forms and the literature, each number with its band",
      add_options, [](ValidateOptions& options, CommandLine) { return validate_command(options); });
}

}  // namespace talus
