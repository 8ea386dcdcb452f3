#include "apps/commands/commands.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/commands/partition_command.hpp"
#include "apps/shared/options.hpp"
#include "partition/partitioners.hpp"
#include "runtime/step/setup.hpp"

namespace talus {

namespace {

void add_options(CLI::App& app, PartitionCommandOptions& options) {
  app.add_option("scene", options.scene, "scene file")->type_name("FILE")->required();
  app.add_option("--subdomains", options.subdomains, "number of subdomains")
      ->type_name("N")
      ->required()
      ->check(CLI::Range(1, most_subdomains));
  app.add_option(
         "--partitioner", options.partitioners,
         fmt::format("{}, may be repeated [all but auto]", fmt::join(partitioner_registry().names(), ", ")))
      ->type_name("NAME")
      ->allow_extra_args(false);
  app.add_option("--out", options.out, "directory of the files [out/partition-NAME]")->type_name("DIR");
  app.add_flag("--force", options.force, "replace earlier partitions in the directory");
  add_threads(app, options.threads);
  add_overrides(app, options.overrides);
}

}  // namespace

Command partition_entry() {
  return command<PartitionCommandOptions>(
      "partition", "cut a scene's sample into subdomains: loads and interfaces of each partitioner",
      add_options, [](PartitionCommandOptions& options, CommandLine) { return partition_command(options); });
}

}  // namespace talus
