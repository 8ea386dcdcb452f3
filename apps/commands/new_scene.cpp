#include "apps/commands/new_scene.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <stdexcept>

#include "apps/shared/exit_codes.hpp"
#include "apps/shared/print.hpp"
#include "io/files/output_directory.hpp"
#include "io/scene/scene.hpp"

namespace talus {

namespace {

const SceneKind& kind_of(const std::string& name) {
  const auto& kinds = scene_kinds();
  const auto found = std::ranges::find(kinds, name, &SceneKind::name);
  if (found != kinds.end()) return *found;
  std::string known;
  for (const SceneKind& kind : kinds) known += fmt::format("{}{}", known.empty() ? "" : ", ", kind.name);
  throw std::invalid_argument(fmt::format("there is no kind '{}': {}", name, known));
}

/// The texts of all kinds are sound, so that only the name can be wrong.
void demand_name(const std::string& name, const std::string& text) {
  if (name.ends_with(".toml"))
    throw std::invalid_argument(
        fmt::format("the file of a scene '{0}' would be {0}.toml: leave .toml out of the name", name));
  try {
    io::parse_scene(text, name);
  } catch (const std::exception&) {
    throw std::invalid_argument(fmt::format(
        "no scene can be called '{}': a name is made of at most 100 letters, digits, +, - and _", name));
  }
}

}  // namespace

int new_command(const NewOptions& options) {
  const std::filesystem::path path = options.name + ".toml";
  const std::string name = path.stem().string();
  std::string text;
  try {
    const SceneKind& kind = kind_of(options.kind);
    text = fmt::format(
        "# {0}: {1}. Run it with\n#\n#     talus run {0}.toml --out out/{0}\n#\n"
        "# docs/scenes.md has every key; `talus scene-reference` prints it.\n\nname = \"{0}\"\n{2}",
        name, kind.sentence, kind.text);
    demand_name(name, text);
    io::check_output_files({}, {path}, options.force);
  } catch (const std::exception& error) {
    print_error("talus: error: {}\n", error.what());
    return exit_bad_input;
  }
  try {
    io::write_whole(path, text);
  } catch (const std::exception& error) {
    print_error("talus: error: {}\n", error.what());
    return exit_failure;
  }
  print_error("talus: {} written; `talus run {} --out out/{}` runs it\n", path.string(), path.string(), name);
  return exit_done;
}

}  // namespace talus
