#include "apps/commands/commands.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <string>

#include "apps/shared/options.hpp"
#include "apps/study_stability/study_stability.hpp"
#include "runtime/step/methods/method.hpp"

namespace talus {

namespace {

void add_options(CLI::App& app, StabilityOptions& options) {
  app.add_option("--only", options.only, "scenes with this in their name, may be repeated [all]")
      ->type_name("NAME")
      ->allow_extra_args(false);
  app.add_option_function<std::string>(
         "--method",
         [&options](const std::string& name) { options.settings.method = methods().named(name).kind; },
         "solver.method of every scene")
      ->check(CLI::IsMember(methods().names()).description(""))
      ->type_name(fmt::format("{}", fmt::join(methods().names(), "|")));
  app.add_option("--tolerance", options.settings.tolerance,
                 "solver.tolerance of every scene, balance_tolerance 50 times as much [the default ones]")
      ->type_name("T")
      ->check(above_zero());
  app.add_option("--seconds", options.settings.seconds, "a scene is stopped after so many seconds")
      ->capture_default_str()
      ->check(above_zero());
  app.add_option("--out", options.out, "directory of the files [out/study-stability]")->type_name("DIR");
  app.add_flag("--force", options.force, "replace earlier results in the directory");
  app.add_flag("--list", options.list, "print the names of the scenes, run nothing");
}

}  // namespace

Command study_stability_entry() {
  return command<StabilityOptions>(
      "stability", "stiff and extreme scenes with known answers: true errors against certificates",
      add_options, [](StabilityOptions& options, CommandLine) { return stability_command(options); });
}

}  // namespace talus
