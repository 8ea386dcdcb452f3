#include "io/scene/detail/material_keys.hpp"

#include <utility>

#include "kernels/law/law_numbers.hpp"

namespace talus::io::detail {

namespace {

/// The laws of a scene or a stage.
PairTable& laws_of(Stage& stage) {
  return stage.laws;
}
const PairTable& laws_of(const Stage& stage) {
  return stage.laws;
}
PairTable& laws_of(Scene& scene) {
  return scene.common.laws;
}
const PairTable& laws_of(const Scene& scene) {
  return scene.common.laws;
}

Range range_of(const LawNumberEntry& entry) {
  return {.low = 0, .high = entry.most};
}

/// A number that the short form gives to all contacts.
template <class Part>
Key<Part> key_of_all(const LawNumberEntry& entry) {
  return bound<double, Part>(
      entry.name, entry.unit, range_of(entry), entry.sentence,
      [number = entry.number](Part& part, double value) { laws_of(part).set_all(number, value); },
      [number = entry.number](const Part& part) -> Value {
        return number.in(laws_of(part).between(material_of_grains, material_of_grains));
      });
}

/// Contacts of a scene with one material.
template <class Part>
std::vector<Key<Part>> law_keys() {
  const Range friction = range_of(law_numbers().front());
  std::vector<Key<Part>> keys = {
      key<Part>(
          "friction", "", friction, "Coulomb friction between grains.", [](auto& part) -> auto& {
            return laws_of(part).between(material_of_grains, material_of_grains).friction;
          }),
      key<Part>(
          "wall_friction", "", friction, "Coulomb friction between grains and walls.",
          [](auto& part) -> auto& {
            return laws_of(part).between(material_of_grains, material_of_walls).friction;
          })};
  for (const LawNumberEntry& entry : law_numbers())
    if (entry.name != keys.front().name) keys.push_back(key_of_all<Part>(entry));
  return keys;
}

Section<PairSpec> pair_section(const char* header, const char* meaning, const std::string& otherwise) {
  std::vector<Key<PairSpec>> keys = {
      key<PairSpec>("material", "", any, "Name of one material.", &PairSpec::material).need(),
      key<PairSpec>("with", "", any, "Name of the other.", &PairSpec::with).or_else("the same")};
  for (std::size_t k = 0; k < law_numbers().size(); ++k) {
    const LawNumberEntry& entry = law_numbers()[k];
    keys.push_back(key<PairSpec>(
                       entry.name, entry.unit, range_of(entry),
                       entry.sentence, [k](auto& pair) -> auto& { return pair.numbers[k]; })
                       .or_else(otherwise));
  }
  return {header, meaning, std::move(keys)};
}

}  // namespace

Section<Scene> material_keys() {
  std::vector<Key<Scene>> keys = {
      key<Scene>("density", "kg/m³", sound_density, "Mass per volume of a grain.", &Scene::density).need()};
  for (Key<Scene>& law_key : law_keys<Scene>()) keys.push_back(std::move(law_key));
  return {"[material]",
          "What the grains are made of, where all are of one material. What is said of contacts holds in the "
          "stages that do not give their own.",
          std::move(keys)};
}

Section<MaterialSpec> named_material_keys() {
  return {
      "[[material]]",
      "Several materials, instead of `[material]`: samples and walls name theirs, and a `[[pair]]` says "
      "what holds between two.",
      {key<MaterialSpec>("name", "", any, "Name, unique among the materials.", &MaterialSpec::name).need(),
       key<MaterialSpec>("density", "kg/m³", sound_density, "Mass per volume of a grain.",
                         &MaterialSpec::density)
           .need()}};
}

Section<PairSpec> pair_keys() {
  return pair_section(
      "[[pair]]",
      "Contacts between two materials. Of a number that no pair gives, grains of one material "
      "have 0, and two different materials the smaller of the two that they have with "
      "themselves.",
      "see above");
}

Section<PairSpec> stage_pair_keys() {
  return pair_section("[[stage.pair]]", "What a stage changes between two materials.", "that of the scene");
}

std::vector<Key<Stage>> stage_law_keys() {
  std::vector<Key<Stage>> keys;
  for (Key<Stage>& law_key : law_keys<Stage>())
    keys.push_back(std::move(law_key).or_else("that of the material"));
  return keys;
}

std::vector<PairSpec> pairs_of(const PairTable& laws, const std::vector<MaterialSpec>& materials) {
  std::vector<PairSpec> pairs;
  for (std::size_t b = 0; b < materials.size(); ++b)
    for (std::size_t a = 0; a <= b; ++a) {
      const PairLaw& law = laws.between(static_cast<Material>(a), static_cast<Material>(b));
      PairSpec& pair = pairs.emplace_back();
      pair.material = materials[a].name;
      pair.with = materials[b].name;
      for (std::size_t k = 0; k < pair.numbers.size(); ++k) pair.numbers[k] = law_numbers()[k].number.in(law);
    }
  return pairs;
}

}  // namespace talus::io::detail
