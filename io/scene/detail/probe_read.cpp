#include "io/scene/detail/probe_read.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "io/scene/detail/grain_read.hpp"
#include "io/scene/detail/scene_read.hpp"
#include "runtime/step/cell.hpp"

namespace talus::io::detail {

namespace {

void read_probe(const toml::table& table, const std::string& path, Scene& scene) {
  using Kind = Region::Kind;
  ProbeRule rule;
  read_table(table, path, scene_keys().probe, {"region"}, rule);
  settle_name(table, path, "probe", scene.setup.probes, rule);
  rule.region =
      needed_region(table, path, {Kind::box, Kind::cylinder, Kind::beyond, Kind::disc, Kind::plane});
  if (const std::string fault = fault_in_cell(scene.setup, rule.region); !fault.empty())
    fail_at(table, path + ".region", fmt::format("probe '{}' {}", rule.name, fault));
  if (!rule.every && !rule.every_steps) rule.every_steps = scene.output.tables_every;
  scene.setup.probes.push_back(std::move(rule));
}

void read_field(const toml::table& table, const std::string& path, Scene& scene) {
  FieldRule rule;
  read_table(table, path, scene_keys().field, {}, rule);
  settle_name(table, path, "field", scene.setup.fields, rule);
  for (const std::string& fault : {fault_of(rule), fault_in_cell(scene.setup, rule)})
    if (!fault.empty()) fail_at(table, path, fault);
  scene.setup.fields.push_back(std::move(rule));
}

/// How far the region reaches along a direction, seen from a point [m]; infinite where nothing ends it.
double reach_along(const Region& region, const Vec3& direction, const Vec3& from) {
  if (!region.is_surface() && region.kind != Region::Kind::beyond) {
    const Bounds bounds = bounds_of(region);
    return (bounds.low - from)
        .cwiseProduct(direction)
        .cwiseMax((bounds.high - from).cwiseProduct(direction))
        .sum();
  }
  if (region.kind == Region::Kind::disc) {
    const double cosine = direction.dot(region.axis) / region.axis.norm();
    return (region.centre - from).dot(direction) +
           region.radius * std::sqrt(std::max(0.0, 1 - cosine * cosine));
  }
  constexpr double parallel = 1 - 1e-12;
  const double cosine = direction.dot(region.normal) / region.normal.norm();
  const bool ends = region.kind == Region::Kind::plane ? std::abs(cosine) > parallel : cosine < -parallel;
  return ends ? (region.point - from).dot(direction) : std::numeric_limits<double>::infinity();
}

}  // namespace

void read_probes(const toml::table& root, Scene& scene) {
  for (const toml::table* table : tables_at(root, "probe", "probe"))
    read_probe(*table, fmt::format("probe[{}]", scene.setup.probes.size()), scene);
  for (const toml::table* table : tables_at(root, "field", "field"))
    read_field(*table, fmt::format("field[{}]", scene.setup.fields.size()), scene);
}

std::string probe_fault(const ProbeRule& probe, const std::vector<Wall>& walls) {
  for (const Wall& wall : walls) {
    const bool stays = wall.surface() == nullptr && wall.motion.empty() && wall.from_stage.empty() &&
                       wall.until_stage.empty() && wall.load.drive == WallDrive::fixed;
    if (stays && reach_along(probe.region, wall.normal, wall.point) < 0)
      return fmt::format("probe '{}' lies behind wall '{}', where no grain comes; mend its region",
                         probe.name, wall.name);
  }
  return "";
}

}  // namespace talus::io::detail
