#include "io/scene/detail/material_read.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include "io/scene/detail/spelling.hpp"

namespace talus::io::detail {

namespace {

std::vector<std::string> names_of(const Scene& scene) {
  std::vector<std::string> names;
  for (const MaterialSpec& material : scene.materials) names.push_back(material.name);
  return names;
}

Material material_named(const std::string& name, const toml::node& at, const std::string& path,
                        const Scene& scene) {
  const std::vector<std::string> names = names_of(scene);
  const auto found = std::ranges::find(names, name);
  if (found == names.end())
    fail_at(at, path, fmt::format("no material is named '{}'{}", name, hint(name, names)));
  return static_cast<Material>(found - names.begin());
}

using PairOfMaterials = std::pair<Material, Material>;

/// A pair of materials, and a place among law_numbers().
using NumberOfPair = std::pair<std::size_t, std::size_t>;

/// Reads the pairs of an array of tables into `laws`; of numbers that are not given nothing changes. Returns
/// which pair has which numbers of its own.
std::set<NumberOfPair> read_pairs(const toml::table& parent, const std::string& path,
                                  const Section<PairSpec>& keys, const Scene& scene, PairTable& laws) {
  std::set<NumberOfPair> given;
  std::set<PairOfMaterials> seen;
  std::size_t count = 0;
  for (const toml::table* table : tables_at(parent, "pair", path)) {
    const std::string here = fmt::format("{}[{}]", path, count++);
    PairSpec pair;
    read_table(*table, here, keys, {}, pair);
    if (pair.with.empty()) pair.with = pair.material;
    const Material a = material_named(pair.material, *table->get("material"), here + ".material", scene);
    const toml::node* with = table->get("with");
    const Material b = with ? material_named(pair.with, *with, here + ".with", scene) : a;
    if (!seen.insert(std::minmax(a, b)).second)
      fail_at(*table, here, fmt::format("'{}' with '{}' stands here already", pair.material, pair.with));
    for (std::size_t k = 0; k < pair.numbers.size(); ++k) {
      if (!pair.numbers[k]) continue;
      law_numbers()[k].number.in(laws.between(a, b)) = *pair.numbers[k];
      given.emplace(PairTable::number(a, b), k);
    }
  }
  return given;
}

}  // namespace

void read_materials(const toml::table& root, Scene& scene) {
  const toml::node* node = root.get("material");
  if (!node || !node->is_array()) {
    const toml::table nothing;
    if (!node) fail_at(root, "material", "missing table [material]");
    if (!node->is_table()) fail_at(*node, "material", "must be a table: write [material]");
    if (const toml::node* pair = root.get("pair"))
      fail_at(*pair, "pair", "needs several materials: write [[material]] with a name for each");
    return read_table(*node->as_table(), "material", scene_keys().material, {}, scene);
  }
  for (const toml::table* table : tables_at(root, "material", "material")) {
    const std::string path = fmt::format("material[{}]", scene.materials.size());
    MaterialSpec material;
    read_table(*table, path, scene_keys().named_material, {}, material);
    check_name(*table, path, material.name);
    if (std::ranges::find(scene.materials, material.name, &MaterialSpec::name) != scene.materials.end())
      fail_at(*table->get("name"), path + ".name",
              fmt::format("another material is named '{}' already", material.name));
    scene.materials.push_back(std::move(material));
  }
  if (scene.materials.empty() || scene.materials.size() > most_materials)
    fail_at(*node, "material",
            fmt::format("between 1 and {} materials are possible, not {}", most_materials,
                        scene.materials.size()));
  PairTable& laws = scene.common.laws = PairTable(scene.materials.size());
  const auto given = read_pairs(root, "pair", scene_keys().pair, scene, laws);
  for (std::size_t b = 0; b < scene.materials.size(); ++b)
    for (std::size_t a = 0; a < b; ++a)
      for (std::size_t k = 0; k < law_numbers().size(); ++k) {
        const auto i = static_cast<Material>(a), j = static_cast<Material>(b);
        const LawNumber& number = law_numbers()[k].number;
        if (!given.contains({PairTable::number(i, j), k}))
          number.in(laws.between(i, j)) =
              std::min(number.in(laws.between(i, i)), number.in(laws.between(j, j)));
      }
}

void read_stage_pairs(const toml::table& table, const std::string& path, const Scene& scene, Stage& stage) {
  if (scene.materials.empty()) {
    if (const toml::node* pair = table.get("pair"))
      fail_at(*pair, path + ".pair", "needs several materials: write [[material]] with a name for each");
    return;
  }
  if (const auto friction = table["friction"].value<double>())
    stage.laws.set_all(&PairLaw::friction, *friction);
  read_pairs(table, path + ".pair", scene_keys().stage_pair, scene, stage.laws);
}

Material read_material(const toml::table& table, const std::string& path, const Scene& scene,
                       Material otherwise) {
  const toml::node* node = table.get("material");
  if (!node) return scene.materials.empty() ? otherwise : Material{0};
  if (scene.materials.empty())
    fail_at(*node, joined(path, "material"), "no material has a name: write [[material]], not [material]");
  return material_named(node->value_or(std::string()), *node, joined(path, "material"), scene);
}

}  // namespace talus::io::detail
