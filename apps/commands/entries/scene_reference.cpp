#include "apps/commands/commands.hpp"

#include "apps/shared/exit_codes.hpp"
#include "apps/shared/print.hpp"
#include "io/scene/scene.hpp"

namespace talus {

namespace {

struct NoOptions {};

int print_reference(NoOptions&, CommandLine) {
  print_out("{}", io::scene_reference());
  return exit_done;
}

}  // namespace

Command scene_reference_entry() {
  return command<NoOptions>(
      "scene-reference", "print docs/scenes.md: every key of a scene file", [](CLI::App&, NoOptions&) {},
      print_reference);
}

}  // namespace talus
