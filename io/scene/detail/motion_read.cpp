#include "io/scene/detail/motion_read.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <utility>

#include "io/scene/detail/scene_read.hpp"
#include "io/scene/detail/spelling.hpp"
#include "io/scene/motion_file.hpp"

namespace talus::io::detail {

namespace {

void read_axis(const toml::table& table, const std::string& path, const MotionPart& part) {
  for (const char* name : {"axis", "point"})
    if (!table.get(name) && part.turns())
      fail_at(table, joined(path, name), "missing; expected: list of 3 reals, for what turns");
    else if (const toml::node* node = table.get(name); node && !part.turns())
      fail_at(*node, joined(path, name), "has a meaning only with: rotation, or a table of angles");
  if (part.turns() && part.axis == Vec3::Zero())
    fail_at(*table.get("axis"), path + ".axis", "must not be zero: nothing turns about no direction");
  if (part.kind == MotionPart::Kind::oscillation && part.direction == Vec3::Zero())
    fail_at(*table.get("direction"), path + ".direction", "must not be zero");
}

MotionPart read_part(const toml::table& table, const std::string& path, const std::filesystem::path& folder) {
  MotionPart part;
  read_table(table, path, scene_keys().wall_motion, {}, part);
  if (part.kind == MotionPart::Kind::table) {
    part.file = (folder / part.file).lexically_normal().string();
    if (!std::filesystem::is_regular_file(part.file))
      fail_at(*table.get("file"), path + ".file", fault_of_file(part.file));
    part.table = std::make_shared<const MotionTable>(read_motion(part.file));
  }
  read_axis(table, path, part);
  return part;
}

std::vector<MotionPart> read_parts(const toml::table& table, const std::string& path,
                                   const std::filesystem::path& folder) {
  std::vector<MotionPart> parts;
  for (const toml::table* entry : tables_at(table, "motion", path + ".motion"))
    parts.push_back(read_part(*entry, fmt::format("{}.motion[{}]", path, parts.size()), folder));
  return parts;
}

std::vector<std::string> names_of_groups(const Scene& scene) {
  std::vector<std::string> names;
  for (const WallGroup& group : scene.setup.groups) names.push_back(group.name);
  return names;
}

/// Number of a stage that a wall or a motion names, or `otherwise` where it names none.
std::size_t stage_at(const toml::table& table, const std::string& path, const char* key, const Scene& scene,
                     std::size_t otherwise) {
  const toml::node* node = table.get(key);
  if (!node) return otherwise;
  const std::string name = *node->value<std::string>();
  std::vector<std::string> names;
  for (const Stage& stage : scene.setup.stages) names.push_back(stage.name);
  const auto found = std::ranges::find(names, name);
  if (found == names.end())
    fail_at(*node, joined(path, key), fmt::format("no stage is named '{}'{}", name, hint(name, names)));
  return static_cast<std::size_t>(found - names.begin());
}

struct StageRange {
  std::size_t from, until;
};
StageRange stages_at(const toml::table& table, const std::string& path, const Scene& scene) {
  const StageRange stages{stage_at(table, path, "from_stage", scene, 0),
                          stage_at(table, path, "until_stage", scene, scene.setup.stages.size())};
  if (stages.until <= stages.from)
    fail_at(*table.get("until_stage"), path + ".until_stage",
            "must come after from_stage: there is no stage between them");
  return stages;
}

/// Time that the stages take for sure [s]; none where they may end sooner.
std::optional<double> time_of(const Scene& scene, StageRange stages) {
  double sum = 0;
  for (std::size_t k = stages.from; k < stages.until; ++k) {
    const Stage& stage = scene.setup.stages[k];
    const StageEnd& end = stage.end;
    if (end.by_state() || (end.steps && stage.chooses_time_step)) return std::nullopt;
    double time = end.time.value_or(std::numeric_limits<double>::infinity());
    if (end.time && !stage.chooses_time_step) time = steps_in(time, stage.time_step) * stage.time_step;
    if (end.steps) time = std::min(time, static_cast<double>(*end.steps) * stage.time_step);
    sum += time;
  }
  return sum;
}

/// Of a wall that turns by one rate [s]; infinity of one that stands, or whose surface alone moves.
double time_of_turn(const MotionPart& part) {
  const bool stands = part.rate == 0 || part.surface_only;
  return stands ? std::numeric_limits<double>::infinity() : 2 * std::numbers::pi / std::abs(part.rate);
}

void check_parts(const toml::table& table, const std::string& path, const Scene& scene,
                 const std::vector<MotionPart>& parts) {
  std::size_t k = 0;
  for (const toml::table* entry : tables_at(table, "motion", path + ".motion")) {
    const MotionPart& part = parts[k];
    const std::string here = fmt::format("{}.motion[{}]", path, k++);
    const StageRange stages = stages_at(*entry, here, scene);
    const bool turns = part.kind == MotionPart::Kind::rotation;
    const char* key = turns ? "rate" : "frequency";
    const std::optional<double> time = time_of(scene, stages);
    if (part.table && time && part.table->end() < *time * (1 - 1e-9))
      fail_at(
          *entry->get("file"), here + ".file",
          fmt::format("the table ends at {} s, and the stages of this motion last {} s. Give it more rows, "
                      "or the motion an until_stage",
                      part.table->end(), *time));
    for (std::size_t s = stages.from; s < stages.until; ++s) {
      const Stage& stage = scene.setup.stages[s];
      const double period = turns ? time_of_turn(part) : shortest_period({&part, 1});
      const double step = stage.shortest_step();
      constexpr double steps_of_period = 8;
      if (step * steps_of_period > period)
        fail_at(*entry->get(key), here + "." + key,
                fmt::format("a {} of {:g} s has less than {} steps of {:g} s in stage '{}'. Reduce its {}",
                            turns ? "turn" : "period", period, steps_of_period, step, stage.name,
                            stage.chooses_time_step ? "time_step_min" : "time_step, or let it be \"auto\""));
    }
  }
}

}  // namespace

void read_groups(const toml::table& root, const std::filesystem::path& folder, Scene& scene) {
  std::vector<WallGroup>& groups = scene.setup.groups;
  for (const toml::table* table : tables_at(root, "group", "group")) {
    const std::string path = fmt::format("group[{}]", groups.size());
    WallGroup group;
    read_table(*table, path, scene_keys().group, {"motion"}, group);
    check_name(*table, path, group.name);
    if (std::ranges::find(groups, group.name, &WallGroup::name) != groups.end())
      fail_at(*table->get("name"), path + ".name",
              fmt::format("another group is named '{}' already", group.name));
    group.motion = read_parts(*table, path, folder);
    groups.push_back(std::move(group));
  }
}

void read_motion_of_wall(const toml::table& table, const std::string& path,
                         const std::filesystem::path& folder, const Scene& scene, Wall& wall) {
  wall.motion = read_parts(table, path, folder);
  const std::vector<WallGroup>& groups = scene.setup.groups;
  if (!wall.group.empty()) {
    const auto group = std::ranges::find(groups, wall.group, &WallGroup::name);
    if (group == groups.end())
      fail_at(
          *table.get("group"), path + ".group",
          fmt::format("no [[group]] is named '{}'{}", wall.group, hint(wall.group, names_of_groups(scene))));
    if (!wall.motion.empty() && !group->motion.empty())
      fail_at(*table.get("motion"), path + ".motion",
              fmt::format("group '{}' has a motion: its walls have none of their own", wall.group));
    if (wall.motion.empty()) wall.motion = group->motion;
    if (!wall.torque_point.allFinite() && std::ranges::none_of(wall.motion, &MotionPart::turns))
      wall.torque_point = group->torque_point;
  }
  if (!wall.motion.empty() && wall.load.drive != WallDrive::fixed)
    fail_at(*table.get("drive"), path + ".drive",
            fmt::format("wall '{}' has a [[wall.motion]], also through its group, and that alone moves it. "
                        "Leave drive out, or the motion",
                        wall.name));
  if (std::ranges::find(groups, wall.name, &WallGroup::name) != groups.end())
    fail_at(*table.get("name"), path + ".name", fmt::format("a [[group]] is named '{}' already", wall.name));
}

void check_motions(const toml::table& root, const Scene& scene) {
  const Setup& setup = scene.setup;
  std::size_t g = 0;
  for (const toml::table* table : tables_at(root, "group", "group")) {
    const WallGroup& group = setup.groups[g];
    const std::string path = fmt::format("group[{}]", g++);
    if (std::ranges::find(setup.walls, group.name, &Wall::group) == setup.walls.end())
      fail_at(*table, path,
              fmt::format("no wall is of group '{}': give a wall group = \"{}\"", group.name, group.name));
    check_parts(*table, path, scene, group.motion);
  }
  std::size_t w = 0;
  for (const toml::table* table : tables_at(root, "wall", "wall")) {
    const std::string path = fmt::format("wall[{}]", w++);
    stages_at(*table, path, scene);
    if (!table->get("motion")) continue;
    const auto wall = std::ranges::find(setup.walls, (*table)["name"].value_or(std::string()), &Wall::name);
    check_parts(*table, path, scene, wall->motion);
  }
}

}  // namespace talus::io::detail
