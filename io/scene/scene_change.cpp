#include "io/scene/scene_change.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <sstream>
#include <string_view>

#include "io/scene/detail/toml_document.hpp"
#include "kernels/law/law_numbers.hpp"

namespace talus::io {

namespace {

using Leaves = std::map<std::string, std::string>;

/// Elements of an array of tables go by their names, where they have one.
std::string name_in(const toml::array& array, std::size_t k) {
  if (const toml::table* table = array[k].as_table())
    for (const char* key : {"name", "wall"})
      if (const auto name = (*table)[key].value<std::string>()) return *name;
  return std::to_string(k);
}

/// As scenes write it.
std::string text_of(const toml::node& node) {
  if (const auto* real = node.as_floating_point()) return fmt::format("{}", real->get());
  std::ostringstream text;
  if (const toml::array* list = node.as_array()) {
    for (const toml::node& entry : *list) text << (text.tellp() > 0 ? ", " : "[") << text_of(entry);
    text << ']';
  } else {
    node.visit([&](const auto& value) { text << value; });
  }
  return text.str();
}

void collect(const toml::node& node, const std::string& path, Leaves& leaves) {
  const auto below = [&](const std::string& key) { return path.empty() ? key : path + "." + key; };
  if (const toml::table* table = node.as_table()) {
    for (const auto& [key, value] : *table) collect(value, below(std::string(key.str())), leaves);
    return;
  }
  const toml::array* array = node.as_array();
  if (array != nullptr && !array->empty() && array->front().is_table()) {
    std::string order;
    for (std::size_t k = 0; k < array->size(); ++k) {
      const std::string name = name_in(*array, k);
      collect((*array)[k], below(name), leaves);
      order += (k > 0 ? ", " : "") + name;
    }
    // By it checkpoints tell which wall, stage, rule or material is meant; loads of a stage go by their
    // walls.
    if (path.find('.') == std::string::npos) leaves["order of " + path] = order;
    return;
  }
  leaves[path] = text_of(node);
}

Leaves leaves_of(const std::string& scene) {
  Leaves leaves;
  collect(toml::parse(scene), "", leaves);
  return leaves;
}

/// Whether the key is of this table of a stage, whose own name may be the same.
bool is_of_stage(const std::string& key, const std::string_view table) {
  const std::string_view front = "stage.";
  return key.starts_with(front) && key.find(table, front.size()) != std::string::npos;
}

bool may_change(const std::string& key) {
  for (const std::string_view front :
       {"output.", "checkpoint.", "decomposition.mapping", "decomposition.overlap", "solver.simd",
        "description", "name", "allow_unconverged"})
    if (key.starts_with(front)) return true;
  if (is_of_stage(key, ".end.") || is_of_stage(key, ".load.")) return true;
  if (key.starts_with("probe.")) return key.ends_with(".every") || key.ends_with(".every_steps");
  constexpr std::array<std::string_view, 7> loads{"drive",  "pressure",           "force", "velocity", "mass",
                                                  "weight", "tangential_velocity"};
  const std::string_view last = std::string_view(key).substr(key.rfind('.') + 1);
  return key.starts_with("wall.") && key.find(".motion.") == std::string::npos &&
         std::ranges::find(loads, last) != loads.end();
}

/// A number of the law between materials is 0 where the version that wrote the scene did not know it.
bool was_zero(const std::string& key) {
  const std::string_view last = std::string_view(key).substr(key.rfind('.') + 1);
  return std::ranges::any_of(law_numbers(), [&](const LawNumberEntry& entry) { return last == entry.name; });
}

}  // namespace

std::vector<SceneChange> scene_changes(const std::string& was, const std::string& is) {
  const Leaves before = leaves_of(was), now = leaves_of(is);
  std::map<std::string, SceneChange> changes;
  const auto value_in = [](const Leaves& leaves, const std::string& key) {
    const auto found = leaves.find(key);
    return found == leaves.end() ? std::string() : found->second;
  };
  for (const Leaves* leaves : {&before, &now})
    for (const auto& [key, value] : *leaves)
      if (value_in(before, key) != value_in(now, key) &&
          !(!before.contains(key) && value_in(now, key) == "0" && was_zero(key)))
        changes[key] = {key, value_in(before, key), value_in(now, key), may_change(key)};
  std::vector<SceneChange> sorted;
  for (auto& [key, change] : changes) sorted.push_back(std::move(change));
  return sorted;
}

bool moves_an_end(const SceneChange& change) {
  return is_of_stage(change.key, ".end.");
}

std::string describe(const SceneChange& change) {
  const auto said = [](const std::string& value) { return value.empty() ? std::string("not given") : value; };
  return fmt::format("{} was {} and is {}", change.key, said(change.was), said(change.is));
}

std::vector<std::string> input_files(const Scene& scene) {
  std::vector<std::string> files;
  for (const SampleSpec& sample : scene.samples)
    if (sample.kind == SampleSpec::Kind::bodies) files.push_back(sample.file);
  for (const Wall& wall : scene.setup.walls)
    if (!wall.shape.values.file.empty()) files.push_back(wall.shape.values.file);
  for (const Wall& wall : scene.setup.walls)
    for (const MotionPart& part : wall.motion)
      if (!part.file.empty() && std::ranges::find(files, part.file) == files.end())
        files.push_back(part.file);
  return files;
}

std::vector<std::filesystem::path> files_read(const Scene& scene) {
  const std::vector<std::string> named = input_files(scene);
  std::vector<std::filesystem::path> files(named.begin(), named.end());
  for (const SampleSpec& sample : scene.samples)
    if (sample.kind == SampleSpec::Kind::state) files.emplace_back(sample.file);
  return files;
}

}  // namespace talus::io
