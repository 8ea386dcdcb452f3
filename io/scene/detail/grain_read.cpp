#include "io/scene/detail/grain_read.hpp"

#include <algorithm>
#include <functional>

#include "io/scene/detail/material_read.hpp"
#include "io/scene/detail/sample_read.hpp"
#include "io/scene/detail/scene_read.hpp"
#include "io/scene/detail/spelling.hpp"

namespace talus::io::detail {

namespace {

void check_times(const toml::table& table, const std::string& path, const RuleTimes& times,
                 const Scene& scene) {
  if (times.until <= times.from)
    fail_at(*table.get("until"), path + ".until",
            fmt::format("must be later than from = {}, got {}", times.from, times.until));
  if (times.stage.empty()) return;
  std::vector<std::string> names;
  for (const Stage& stage : scene.setup.stages) names.push_back(stage.name);
  if (std::ranges::find(names, times.stage) == names.end())
    fail_at(*table.get("stage"), path + ".stage",
            fmt::format("no stage is named '{}'{}", times.stage, hint(times.stage, names)));
}

void check_amount(const toml::table& table, const std::string& path, const InsertRule& rule) {
  if (rule.rate && rule.mass_rate)
    fail_at(*table.get("mass_rate"), path + ".mass_rate", "give rate or mass_rate, not both");
  if (!rule.count && !rule.mass && !rule.rate && !rule.mass_rate)
    fail_at(table, path, fmt::format("insert '{}' needs count, mass, rate or mass_rate", rule.name));
  constexpr std::int64_t few = 100;
  if (rule.track && rule.count.value_or(few + 1) > few)
    fail_at(*table.get("track"), path + ".track",
            fmt::format("writes every grain in every step: give a count of {} at most", few));
  if (const double least = sphere_mass(smallest_radius(rule.radii), rule.density);
      rule.mass && *rule.mass * (1 + amount_rounding) < least)
    fail_at(*table.get("mass"), path + ".mass",
            fmt::format("{:g} kg is less than the smallest grain has, {:g} kg: none would come", *rule.mass,
                        least));
  for (const double radius : {smallest_radius(rule.radii), largest_radius(rule.radii)})
    if (const double mass = sphere_mass(radius, rule.density); !mass_is_sound(mass))
      fail_at(
          table, path,
          fmt::format("a radius of {} m makes a mass of {} kg, which must lie in {} to {}; give lengths in "
                      "m and densities in kg/m^3",
                      radius, mass, least_mass, most_mass));
  if (const double largest = largest_radius(rule.radii); !has_room(rule.region, largest))
    fail_at(*table.get("region"), path + ".region",
            fmt::format("has no room for the largest grain, {} m wide", 2 * largest));
}

void read_insert(const toml::table& table, const std::string& path, Scene& scene) {
  InsertRule rule;
  read_table(table, path, scene_keys().insert, {"region"}, rule);
  settle_name(table, path, "insert", scene.setup.inserts, rule);
  check_radii(table, path, rule.radii);
  rule.material = read_material(table, path, scene, material_of_grains);
  rule.density = scene.materials.empty() ? scene.density : scene.materials[rule.material].density;
  rule.region = needed_region(table, path, {Region::Kind::box, Region::Kind::cylinder, Region::Kind::disc});
  check_amount(table, path, rule);
  check_times(table, path, rule.times, scene);
  scene.setup.inserts.push_back(std::move(rule));
}

void read_remove(const toml::table& table, const std::string& path, Scene& scene) {
  RemoveRule rule;
  read_table(table, path, scene_keys().remove, {"region"}, rule);
  settle_name(table, path, "remove", scene.setup.removes, rule);
  if (table.get("material")) rule.material = read_material(table, path, scene, material_of_grains);
  rule.region = needed_region(table, path, {Region::Kind::box, Region::Kind::cylinder, Region::Kind::beyond});
  if (std::ranges::adjacent_find(rule.at, std::greater_equal()) != rule.at.end())
    fail_at(*table.get("at"), path + ".at", "times must ascend");
  if (!rule.at.empty() && rule.times.interval > 0)
    fail_at(*table.get("interval"), path + ".interval", "has no meaning with `at`, which has all times");
  check_times(table, path, rule.times, scene);
  scene.setup.removes.push_back(std::move(rule));
}

}  // namespace

Region needed_region(const toml::table& table, const std::string& path,
                     std::initializer_list<Region::Kind> shapes) {
  const auto region = read_region(table, path, shapes);
  if (!region)
    fail_at(
        table, path + ".region",
        "missing; expected a table, e.g. region = { shape = \"box\", low = [0, 0, 0], high = [1, 1, 1] }");
  return *region;
}

void read_grain_rules(const toml::table& root, Scene& scene) {
  for (const MaterialSpec& material : scene.materials) scene.setup.material_names.push_back(material.name);
  for (const toml::table* table : tables_at(root, "insert", "insert"))
    read_insert(*table, fmt::format("insert[{}]", scene.setup.inserts.size()), scene);
  for (const toml::table* table : tables_at(root, "remove", "remove"))
    read_remove(*table, fmt::format("remove[{}]", scene.setup.removes.size()), scene);
}

}  // namespace talus::io::detail
