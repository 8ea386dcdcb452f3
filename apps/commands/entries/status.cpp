#include "apps/commands/status.hpp"
#include "apps/commands/commands.hpp"

namespace talus {

namespace {

void add_options(CLI::App& app, StatusOptions& options) {
  app.add_option("directory", options.directory, "directory of the results")->type_name("DIR")->required();
  app.add_flag("--json", options.json, "print one object, for scripts");
}

int run(StatusOptions& options, CommandLine) {
  return status_command(options);
}

}  // namespace

Command status_entry() {
  return command<StatusOptions>("status", "say how far a run is, from another terminal", add_options, run);
}

}  // namespace talus
