#include <algorithm>
#include <set>

#include "io/scene/detail/material_keys.hpp"
#include "io/scene/detail/scene_keys.hpp"
#include "io/scene/detail/scene_text.hpp"
#include "io/scene/scene.hpp"

namespace talus::io {

namespace {

using namespace detail;

/// The section of one part, every key that applies and holds something on a line of its own, with its unit.
template <class Part>
void write_section(std::string& out, const Section<Part>& section, const Part& part,
                   const std::set<std::string>& left_out = {}, const std::string& header = "") {
  if (!section.header.empty()) out += "\n" + (header.empty() ? section.header : header) + "\n";
  for (const Key<Part>& key : section.keys) {
    if ((key.applies && !key.applies(part)) || left_out.contains(key.name)) continue;
    const std::string text = text_of(key, part);
    if (text.empty()) continue;
    out += fmt::format("{} = {}{}\n", key.name, text, key.unit.empty() ? "" : "  # " + key.unit);
  }
}

void write_materials(std::string& out, const Scene& scene) {
  const SceneKeys& keys = scene_keys();
  if (scene.materials.empty()) return write_section(out, keys.material, scene);
  for (const MaterialSpec& material : scene.materials) write_section(out, keys.named_material, material);
  for (const PairSpec& pair : pairs_of(scene.common.laws, scene.materials))
    write_section(out, keys.pair, pair);
}

void write_samples(std::string& out, const Scene& scene) {
  const SceneKeys& keys = scene_keys();
  for (const SampleSpec& sample : scene.samples) {
    write_section(out, keys.sample, sample, {}, scene.samples.size() > 1 ? "[[sample]]" : "");
    if (sample.region) write_section(out, keys.region, *sample.region);
  }
}

void write_grain_rules(std::string& out, const Scene& scene) {
  const SceneKeys& keys = scene_keys();
  const auto write_material = [&](std::size_t number) {
    out += fmt::format("material = \"{}\"\n", scene.materials[number].name);
  };
  for (const InsertRule& rule : scene.setup.inserts) {
    write_section(out, keys.insert, rule);
    if (!scene.materials.empty()) write_material(rule.material);
    write_section(out, keys.region, rule.region, {}, "[insert.region]");
  }
  for (const RemoveRule& rule : scene.setup.removes) {
    write_section(out, keys.remove, rule);
    if (rule.material) write_material(*rule.material);
    write_section(out, keys.region, rule.region, {}, "[remove.region]");
  }
}

void write_probes(std::string& out, const Scene& scene) {
  const SceneKeys& keys = scene_keys();
  for (const ProbeRule& rule : scene.setup.probes) {
    write_section(out, keys.probe, rule);
    write_section(out, keys.region, rule.region, {}, "[probe.region]");
  }
  for (const FieldRule& rule : scene.setup.fields) write_section(out, keys.field, rule);
}

}  // namespace

std::string resolved_scene(const Scene& scene) {
  const SceneKeys& keys = scene_keys();
  std::string out;
  write_section(out, keys.top, scene);
  write_materials(out, scene);
  if (scene.setup.domain.repeats) write_section(out, keys.cell, scene.cell);
  write_samples(out, scene);
  write_grain_rules(out, scene);
  write_probes(out, scene);
  write_section(out, keys.detection, scene.setup.detection);
  write_section(out, keys.solver, scene.setup.solver);
  write_section(out, keys.decomposition, scene.setup.decomposition);
  write_section(out, keys.output, scene.output);
  write_section(out, keys.checkpoint, scene.checkpoint);
  const bool named = !scene.materials.empty();
  for (const Wall& wall : scene.setup.walls) {
    write_section(out, keys.wall, wall);
    if (named) out += fmt::format("material = \"{}\"\n", scene.materials[wall.material].name);
    const auto group = std::ranges::find(scene.setup.groups, wall.group, &WallGroup::name);
    if (group != scene.setup.groups.end() && !group->motion.empty()) continue;
    for (const MotionPart& part : wall.motion) write_section(out, keys.wall_motion, part);
  }
  for (const WallGroup& group : scene.setup.groups) {
    write_section(out, keys.group, group);
    for (const MotionPart& part : group.motion) write_section(out, keys.group_motion, part);
  }
  std::set<std::string> left_out;
  if (named)
    for (const Key<Stage>& key : stage_law_keys()) left_out.insert(key.name);
  for (const Stage& stage : scene.setup.stages) {
    write_section(out, keys.stage, stage, left_out);
    if (stage.stress.any()) write_section(out, keys.stage_stress, stage.stress);
    write_section(out, keys.stage_end, stage.end);
    for (const StageLoad& load : stage.loads) write_section(out, keys.stage_load, load);
    for (const PairSpec& pair : pairs_of(stage.laws, scene.materials))
      write_section(out, keys.stage_pair, pair);
  }
  return out;
}

}  // namespace talus::io
