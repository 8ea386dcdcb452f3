#include "apps/commands/commands.hpp"

#include <cstdio>

#include "apps/shared/exit_codes.hpp"
#include "io/scene/scene.hpp"

namespace talus {

namespace {

struct NoOptions {};

int print_reference(NoOptions&, CommandLine) {
  std::fputs(io::scene_reference().c_str(), stdout);
  return exit_done;
}

}  // namespace

Command scene_reference_entry() {
  return command<NoOptions>(
      "scene-reference", "print docs/scenes.md: every key of a scene file", [](CLI::App&, NoOptions&) {},
      print_reference);
}

}  // namespace talus
