#include "io/scene/detail/material_keys.hpp"

#include <utility>

namespace talus::io::detail {

namespace {

constexpr const char* rolling_meaning =
    "Moment that resists rolling, over the normal force times the reduced radius; needs friction.";

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

/// A number that the short form gives to all contacts.
template <class Part>
Key<Part> key_of_all(const char* name, const char* unit, Range range, const char* meaning,
                     double PairLaw::*number) {
  return bound<double, Part>(
      name, unit, range, meaning,
      [number](Part& part, double value) { laws_of(part).set_all(number, value); },
      [number](const Part& part) -> Value {
        return laws_of(part).between(material_of_grains, material_of_grains).*number;
      });
}

/// Contacts of a scene with one material.
template <class Part>
std::vector<Key<Part>> law_keys() {
  return {key<Part>(
              "friction", "", not_negative, "Coulomb friction between grains.", [](auto& part) -> auto& {
                return laws_of(part).between(material_of_grains, material_of_grains).friction;
              }),
          key<Part>(
              "wall_friction", "", not_negative, "Coulomb friction between grains and walls.",
              [](auto& part) -> auto& {
                return laws_of(part).between(material_of_grains, material_of_walls).friction;
              }),
          key_of_all<Part>("restitution", "", zero_to_one, "Newton restitution of the normal velocity.",
                           &PairLaw::restitution),
          key_of_all<Part>("cohesion", "N", not_negative,
                           "Force that parts grains that touch one another or a wall.", &PairLaw::cohesion),
          key_of_all<Part>("rolling_resistance", "", not_negative, rolling_meaning,
                           &PairLaw::rolling_resistance)};
}

Section<PairSpec> pair_section(const char* header, const char* meaning, const std::string& otherwise) {
  std::vector<Key<PairSpec>> keys = {
      key<PairSpec>("material", "", any, "Name of one material.", &PairSpec::material).need(),
      key<PairSpec>("with", "", any, "Name of the other.", &PairSpec::with).or_else("the same")};
  const auto add = [&](Key<PairSpec> law_key) { keys.push_back(std::move(law_key).or_else(otherwise)); };
  add(key<PairSpec>("friction", "", not_negative, "Coulomb friction.", &PairSpec::friction));
  add(key<PairSpec>("restitution", "", zero_to_one, "Newton restitution of the normal velocity.",
                    &PairSpec::restitution));
  add(key<PairSpec>("cohesion", "N", not_negative, "Force that parts what touches.", &PairSpec::cohesion));
  add(key<PairSpec>("rolling_resistance", "", not_negative, rolling_meaning, &PairSpec::rolling_resistance));
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
      pairs.push_back({.material = materials[a].name, .with = materials[b].name});
      for (const PairNumber& number : pair_numbers) pairs.back().*number.given = law.*number.held;
    }
  return pairs;
}

}  // namespace talus::io::detail
