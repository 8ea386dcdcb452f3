#include "apps/commands/commands.hpp"
#include "apps/commands/new_scene.hpp"

namespace talus {

namespace {

void add_options(CLI::App& app, NewOptions& options) {
  app.add_option("name", options.name, "name of the scene; NAME.toml is written")
      ->type_name("NAME")
      ->required();
  std::string kinds;
  for (const SceneKind& kind : scene_kinds())
    kinds += (kinds.empty() ? "" : "; ") + std::string(kind.name) + ": " + std::string(kind.sentence);
  app.add_option("--kind", options.kind, kinds)->type_name("KIND")->required();
  app.add_flag("--force", options.force, "replace the file where it is there");
}

int run(NewOptions& options, CommandLine) {
  return new_command(options);
}

}  // namespace

Command new_entry() {
  return command<NewOptions>("new", "write a scene with comments to start from", add_options, run);
}

}  // namespace talus
