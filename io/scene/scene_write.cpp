#include "io/scene/detail/scene_keys.hpp"
#include "io/scene/detail/scene_text.hpp"
#include "io/scene/scene.hpp"

namespace talus::io {

namespace {

using namespace detail;

/// The section of one part, every key that applies and holds something on a line of its own, with its unit.
template <class Part>
void write_section(std::string& out, const Section<Part>& section, const Part& part) {
  if (!section.header.empty()) out += "\n" + section.header + "\n";
  for (const Key<Part>& key : section.keys) {
    if (key.applies && !key.applies(part)) continue;
    const std::string text = text_of(key, part);
    if (text.empty()) continue;
    out += fmt::format("{} = {}{}\n", key.name, text, key.unit.empty() ? "" : "  # " + key.unit);
  }
}

}  // namespace

std::string resolved_scene(const Scene& scene) {
  const SceneKeys& keys = scene_keys();
  std::string out;
  write_section(out, keys.top, scene);
  write_section(out, keys.material, scene);
  write_section(out, keys.sample, scene.sample);
  write_section(out, keys.detection, scene.setup.detection);
  write_section(out, keys.solver, scene.setup.solver);
  write_section(out, keys.decomposition, scene.setup.decomposition);
  write_section(out, keys.output, scene.output);
  for (const Wall& wall : scene.setup.walls) write_section(out, keys.wall, wall);
  for (const Stage& stage : scene.setup.stages) {
    write_section(out, keys.stage, stage);
    write_section(out, keys.stage_end, stage.end);
    for (const NamedLoad& load : stage.loads) write_section(out, keys.stage_load, load);
  }
  return out;
}

}  // namespace talus::io
