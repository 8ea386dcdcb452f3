#include "io/scene/scene.hpp"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <system_error>

#include "io/scene/detail/grain_read.hpp"
#include "io/scene/detail/material_read.hpp"
#include "io/scene/detail/motion_read.hpp"
#include "io/scene/detail/places_read.hpp"
#include "io/scene/detail/probe_read.hpp"
#include "io/scene/detail/sample_read.hpp"
#include "io/scene/detail/scene_read.hpp"
#include "io/scene/detail/shape_keys.hpp"
#include "io/scene/detail/wall_conflict.hpp"
#include "runtime/step/cell.hpp"
#include "runtime/step/stage_loads.hpp"
#include "runtime/step/wall_motions.hpp"

namespace talus::io {

namespace {

using namespace detail;

/// No strain comes from walls that neither move nor are pushed.
bool stands_still(const std::vector<Wall>& walls, const std::vector<WallLoad>& loads) {
  return std::ranges::all_of(loads, [](const WallLoad& load) { return load.drive == WallDrive::fixed; }) &&
         std::ranges::all_of(walls, [](const Wall& wall) { return wall.motion.empty(); });
}

/// Reads the tables of one document into a Scene. Checks between keys stand where the nodes are at hand, for
/// their lines.
class SceneReader {
 public:
  SceneReader(const toml::table& root, const std::string& file)
      : root_(root), folder_(std::filesystem::absolute(file).parent_path()) {
    scene_.source_file = file;
    scene_.places = places_of(root, file);
    scene_.name = std::filesystem::path(file).stem().string();
    for (char& c : scene_.name)
      if (!may_be_in_name(c)) c = '_';
  }

  Scene read() && {
    read_table(root_, "", keys_.top,
               {"material", "pair", "cell", "sample", "insert", "remove", "probe", "field", "wall", "group",
                "stage", "detection", "solver", "decomposition", "output", "checkpoint"},
               scene_);
    if (root_.get("name")) check_name(root_, "", scene_.name);
    read_materials(root_, scene_);
    read_cell();
    read_samples(root_, folder_, scene_);
    read_groups(root_, folder_, scene_);
    read_walls();
    read_stages();
    check_motions(root_, scene_);
    check_stages_of_walls();
    read_grain_rules(root_, scene_);
    check_by_cell([&] { validate_cell(scene_.setup); });
    read_table(table_at(root_, "detection"), "detection", keys_.detection, {}, scene_.setup.detection);
    read_table(table_at(root_, "solver"), "solver", keys_.solver, {}, scene_.setup.solver);
    read_decomposition();
    read_table(table_at(root_, "output"), "output", keys_.output, {}, scene_.output);
    read_probes(root_, scene_);
    read_table(table_at(root_, "checkpoint"), "checkpoint", keys_.checkpoint, {}, scene_.checkpoint);
    if (scene_.output.directory.empty()) scene_.output.directory = "out/" + scene_.name;
    return std::move(scene_);
  }

 private:
  /// A table that may be left out: then an empty one, so that missing keys are found all the same.
  const toml::table& table_at(const toml::table& parent, const std::string& name) {
    const toml::node* node = parent.get(name);
    if (node && !node->is_table()) fail_at(*node, name, fmt::format("must be a table: write [{}]", name));
    return node ? *node->as_table() : nothing_;
  }
  /// What the cell has no room for is told at its line, what is wrong with a stage or a wall at that.
  template <class Check>
  void check_by_cell(const Check& check) const {
    try {
      check();
    } catch (const std::invalid_argument& error) {
      const std::string what = error.what();
      const bool named = what.starts_with("stage '") || what.starts_with("wall '");
      throw error_in(scene_, named ? "" : "cell", what.starts_with("cell: ") ? what.substr(6) : what);
    }
  }

  void read_cell() {
    if (!root_.contains("cell")) return;
    CellSpec& cell = scene_.cell;
    read_table(table_at(root_, "cell"), "cell", keys_.cell, {}, cell);
    scene_.setup.cell_inertia = cell.inertia;
    check_by_cell([&] { scene_.setup.domain = periodic_domain(cell.lengths, cell.origin, cell.shears); });
  }

  void read_walls() {
    std::vector<Wall>& walls = scene_.setup.walls;
    if (!scene_.materials.empty())
      for (Wall& wall : walls) wall.material = 0;
    std::vector<const toml::table*> place(walls.size(), nullptr);  // of the walls of the box: none yet
    for (const toml::table* table : tables_at(root_, "wall", "wall")) {
      const std::string path = fmt::format("wall[{}]", count_++);
      const auto name = (*table)["name"].value<std::string>();
      auto found = name ? std::ranges::find(walls, *name, &Wall::name) : walls.end();
      if (found != walls.end() && place[static_cast<std::size_t>(found - walls.begin())])
        fail_at(*table->get("name"), path + ".name",
                fmt::format("another wall is named '{}' already", *name));
      if (found == walls.end()) {
        Wall wall;
        wall.normal = Vec3::Zero();
        wall.point.setConstant(std::nan(""));
        found = walls.insert(found, wall);
        place.push_back(nullptr);
      }
      read_wall(*table, path, *found);
      place[static_cast<std::size_t>(found - walls.begin())] = table;
    }
    count_ = 0;
    for (std::size_t k = 0; k < walls.size(); ++k)
      if (const std::string fault = wall_conflict(walls, k); !fault.empty()) {
        const toml::table* at = place[k];
        for (std::size_t j = k; !at && j-- > 0;) at = place[j];
        fail_at(at ? *at : root_, "wall", fault);
      }
    for (std::size_t k = 0; k < walls.size(); ++k)
      if (walls[k].load.drive == WallDrive::pressure)
        require_face(walls, k, place[k] ? *place[k] : root_, "wall");
  }

  void read_wall(const toml::table& table, const std::string& path, Wall& wall) {
    if (table.get("side") && table.get("normal"))
      fail_at(*table.get("normal"), path + ".normal", "give side or normal, not both");
    if (table.get("position") && table.get("point"))
      fail_at(*table.get("point"), path + ".point", "give position or point, not both");
    refuse_load(table, path, table["shape"].value_or(std::string("plane")));
    read_table(table, path, keys_.wall, {"motion"}, wall);
    wall.material = read_material(table, path, scene_, material_of_walls);
    check_name(table, path, wall.name);
    read_motion_of_wall(table, path, folder_, scene_, wall);
    if (wall.shape.name != "plane") {
      read_shape(table, path, wall);
      return;
    }
    if (wall.normal.norm() == 0)
      fail_at(table, path + (table.get("normal") ? ".normal" : ".side"),
              fmt::format("wall '{}' needs a side or a normal that is not zero", wall.name));
    if (const int axis = axis_of(wall); axis >= 0) {
      const double position = wall.point[axis];
      wall.point.setZero();
      wall.point[axis] = position;
    } else if (!wall.point.allFinite()) {
      fail_at(table, path + ".point",
              fmt::format("oblique wall '{}' needs a point of its face [m]", wall.name));
    }
    const Vec3 sideways = wall.velocity - wall.velocity.dot(wall.normal) * wall.normal;
    if (sideways.norm() > 1e-9 * wall.velocity.norm())
      fail_at(*table.get("initial_velocity"), path + ".initial_velocity",
              "a wall driven by pressure or force moves along its normal only");
  }

  /// Surfaces are moved by motions alone.
  static void refuse_load(const toml::table& table, const std::string& path, const std::string& shape) {
    const toml::node* drive = table.get("drive");
    if (shape != "plane" && drive != nullptr && drive->value<std::string>() != "fixed")
      fail_at(*drive, path + ".drive",
              fmt::format("only planes can be driven or pushed; a wall with shape = \"{}\" is moved by "
                          "[[wall.motion]]",
                          shape));
  }

  void read_shape(const toml::table& table, const std::string& path, Wall& wall) {
    wall.normal.setZero();
    wall.point.setZero();
    std::string& file = wall.shape.values.file;
    if (!file.empty()) file = (folder_ / file).lexically_normal().string();
    try {
      read_surface(wall);
    } catch (const std::exception& error) {
      const toml::node* at = table.get(file.empty() ? "shape" : "file");
      fail_at(at ? *at : table, path, fmt::format("wall '{}': {}", wall.name, error.what()));
    }
  }

  void require_face(const std::vector<Wall>& walls, std::size_t wall, const toml::table& at,
                    const std::string& path) const {
    try {
      face_area(walls, wall, scene_.setup.domain.edges());
    } catch (const std::invalid_argument& error) {
      fail_at(at, path, error.what());
    }
  }

  void read_stages() {
    const std::vector<const toml::table*> tables = tables_at(root_, "stage", "stage");
    if (tables.empty()) fail_at(root_, "stage", "missing; at least one [[stage]] is needed");
    std::vector<WallLoad> in_force;
    for (const Wall& wall : scene_.setup.walls) in_force.push_back(wall.load);
    for (const toml::table* table : tables) {
      const std::size_t index = scene_.setup.stages.size();
      const std::string path = fmt::format("stage[{}]", index);
      Stage stage = scene_.common;
      if (!scene_.materials.empty() && table->get("wall_friction"))
        fail_at(*table->get("wall_friction"), path + ".wall_friction",
                "walls have materials of their own here: give friction in a [[stage.pair]]");
      read_table(*table, path, keys_.stage, {"end", "stress", "load", "pair"}, stage);
      if (table->get("stress"))
        read_table(table_at(*table, "stress"), path + ".stress", keys_.stage_stress, {}, stage.stress);
      read_stage_pairs(*table, path, scene_, stage);
      check_name(*table, path, stage.name);
      for (const Stage& earlier : scene_.setup.stages)
        if (earlier.name == stage.name)
          fail_at(*table, path + ".name", fmt::format("another stage is named '{}' already", stage.name));
      if (stage.chooses_time_step && stage.time_step_max == 0 && stage.gravity.norm() == 0)
        fail_at(*table, path + ".time_step_max",
                "missing: the longest step [s] that \"auto\" may take, which finds none without gravity");
      if (stage.time_step == 0 && !stage.chooses_time_step)
        fail_at(*table, path + ".time_step", "missing; expected: real [s], here or at the top of the scene");
      read_loads(*table, path, stage, in_force);
      read_end(*table, path, stage, in_force);
      scene_.setup.stages.push_back(std::move(stage));
    }
  }

  void read_loads(const toml::table& table, const std::string& path, Stage& stage,
                  std::vector<WallLoad>& in_force) {
    const std::vector<Wall>& walls = scene_.setup.walls;
    for (const toml::table* entry : tables_at(table, "load", path + ".load")) {
      const std::string load_path = fmt::format("{}.load[{}]", path, stage.loads.size());
      StageLoad own;
      read_table(*entry, load_path, keys_.stage_load, {}, own);
      std::vector<std::string> names;
      for (const Wall& wall : walls) names.push_back(wall.name);
      const auto index =
          static_cast<std::size_t>(std::find(names.begin(), names.end(), own.wall) - names.begin());
      const toml::node& named = *entry->get("wall");
      if (index == names.size())
        fail_at(named, load_path + ".wall",
                fmt::format("no wall is named '{}'{}", own.wall, hint(own.wall, names)));
      for (const StageLoad& earlier : stage.loads)
        if (earlier.wall == own.wall)
          fail_at(named, load_path + ".wall", fmt::format("this stage loads wall '{}' twice", own.wall));
      refuse_load(*entry, load_path, walls[index].shape.name);
      if (own.load.drive != WallDrive::fixed && !walls[index].motion.empty())
        fail_at(named, load_path + ".wall",
                fmt::format("wall '{}' has a motion, and that alone moves it", own.wall));
      if (own.load.drive == WallDrive::pressure) require_face(walls, index, *entry, load_path);
      in_force[index] = own.load;
      stage.loads.push_back(std::move(own));
    }
  }

  /// Walls that come or go with stages leave no pressure without a face, and no load without a wall.
  void check_stages_of_walls() const {
    std::vector<Wall> walls = scene_.setup.walls;
    std::size_t k = 0;
    for (const toml::table* table : tables_at(root_, "stage", "stage")) {
      take_loads(scene_.setup.stages[k], walls);
      resolve_stages(scene_.setup, k, {}, walls);
      for (std::size_t wall = 0; wall < walls.size(); ++wall)
        if (!walls[wall].absent && walls[wall].load.drive == WallDrive::pressure)
          require_face(walls, wall, *table, fmt::format("stage[{}]", k));
      refuse_loads_of_gone(*table, k, walls);
      ++k;
    }
  }
  void refuse_loads_of_gone(const toml::table& table, std::size_t k, const std::vector<Wall>& walls) const {
    const std::vector<Stage>& stages = scene_.setup.stages;
    const std::string path = fmt::format("stage[{}].load", k);
    std::size_t at = 0;
    for (const toml::table* entry : tables_at(table, "load", path)) {
      const std::string& name = stages[k].loads[at].wall;
      const auto wall = std::ranges::find(walls, name, &Wall::name);
      const auto gone = std::ranges::find(stages, wall->until_stage, &Stage::name);
      if (wall->absent && gone - stages.begin() <= static_cast<std::ptrdiff_t>(k))
        fail_at(
            *entry->get("wall"), fmt::format("{}[{}].wall", path, at),
            fmt::format("wall '{}' is gone with the beginning of stage '{}' (until_stage). Leave this load "
                        "out, or let the wall stay longer",
                        name, wall->until_stage));
      ++at;
    }
  }

  void read_decomposition() {
    DecompositionSettings& settings = scene_.setup.decomposition;
    const toml::table& table = table_at(root_, "decomposition");
    read_table(table, "decomposition", keys_.decomposition, {}, settings);
    if (any_stress(scene_.setup) && !table.get("coupling")) settings.coupling = Coupling::nscdd;
    const auto check = [&](const toml::table& of, const char* section, const char* key, const auto& rule) {
      try {
        rule(scene_.setup);
      } catch (const std::invalid_argument& error) {
        fail_at(*of.get(key), fmt::format("{}.{}", section, key), error.what());
      }
    };
    check(table, "decomposition", "coupling", validate_coupling);
    check(table_at(root_, "solver"), "solver", "overlap_correction", validate_correction);
    const auto& [x, y, z] = settings.boxes;
    const double boxes = static_cast<double>(x) * static_cast<double>(y) * static_cast<double>(z);
    if (boxes == 0) return;
    if (boxes > most_subdomains || (settings.subdomains > 0 && boxes != settings.subdomains))
      fail_at(*table.get("boxes"), "decomposition.boxes",
              fmt::format("{} x {} x {} boxes are not {} subdomains", x, y, z,
                          settings.subdomains > 0 ? fmt::format("{}", settings.subdomains)
                                                  : fmt::format("at most {}", most_subdomains)));
    settings.subdomains = static_cast<int>(boxes);
    if (settings.partitioner == PartitionKind::automatic) settings.partitioner = PartitionKind::boxes;
  }

  void read_end(const toml::table& table, const std::string& path, Stage& stage,
                const std::vector<WallLoad>& in_force) {
    const std::string end_path = path + ".end";
    const toml::node* node = table.get("end");
    const std::string conditions =
        "one of steps, time, strain, shear_strain, equilibrium, stress_ratio, inertial_below, "
        "inertial_above, steady";
    if (!node) fail_at(table, end_path, fmt::format("missing; stage '{}' needs {}", stage.name, conditions));
    if (!node->is_table()) fail_at(*node, end_path, "must be a table, e.g. end = { steps = 100 }");
    StageEnd& end = stage.end;
    read_table(*node->as_table(), end_path, keys_.stage_end, {}, end);
    if (!end.any())
      fail_at(*node, end_path, fmt::format("stage '{}' never ends: give {}", stage.name, conditions));
    if (end.strain && !bounded(scene_.setup, end.strain_axis))
      fail_at(*node, end_path + ".strain",
              fmt::format("no two walls bound the sample along {0}, and nothing is periodic there",
                          "xyz"[end.strain_axis]));
    if (end.shear_strain && !scene_.setup.domain.repeats)
      fail_at(*node, end_path + ".shear_strain", "there is no periodic cell that is sheared");
    const bool flows = scene_.setup.domain.repeats && stage.flows();
    for (const char* key : {"inertial_below", "inertial_above"})
      if (node->as_table()->contains(key) && !flows)
        fail_at(*node, fmt::format("{}.{}", end_path, key),
                "needs a periodic cell that flows in this stage: [cell], and rates or a stress");
    const bool ends_else = end.steps || end.time || end.equilibrium || end.by_memory();
    if (end.shear_strain && !stage.shears() && !ends_else && !end.strain)
      fail_at(*node, end_path + ".shear_strain",
              "the cell has no stress in this stage, and no rates that change its shape: it would never end");
    const bool of_cell = scene_.setup.domain.edges()[end.strain_axis] > 0;
    if (end.strain && !ends_else && !(end.shear_strain && stage.shears()) &&
        (of_cell ? !stage.strains(end.strain_axis) : !flows && stands_still(scene_.setup.walls, in_force)))
      fail_at(*node, end_path + ".strain",
              of_cell ? "the cell is not strained along that axis in this stage: it would never end"
                      : "no wall moves or is pushed in this stage: it would never end");
    if (end.steady && !end.steady_time && !flows)
      fail_at(
          *node, end_path + ".steady",
          "no periodic cell is sheared in this stage, by whose shear windows are measured: give steady_time");
    const bool pushed = std::any_of(in_force.begin(), in_force.end(), [](const WallLoad& load) {
      return (load.drive == WallDrive::pressure && load.pressure > 0) ||
             (load.drive == WallDrive::force && load.force > 0);
    });
    if (end.equilibrium && !pushed && !stage.stress.presses() && stage.gravity.norm() == 0)
      fail_at(*node, end_path + ".equilibrium",
              "neither gravity, a pushed wall nor the stress of a cell loads the sample in this stage");
  }

  const toml::table& root_;
  const toml::table nothing_;
  std::filesystem::path folder_;
  const SceneKeys& keys_ = scene_keys();
  Scene scene_;
  std::size_t count_ = 0;
};

}  // namespace

Scene parse_scene(const std::string& text, const std::string& file,
                  const std::vector<std::string>& overrides) {
  const toml::table root = parse_document(text, file, overrides);
  return SceneReader(root, file).read();
}

Scene load_scene(const std::string& path, const std::vector<std::string>& overrides) {
  // Reading from a pipe would wait for whoever writes into it, on every rank.
  std::error_code missing;
  const bool there = std::filesystem::exists(path, missing);
  if (there && !std::filesystem::is_directory(path) && !std::filesystem::is_regular_file(path))
    throw SceneError(path, 0, "", "is a pipe or a device, not a file; write the scene to a file");
  constexpr std::uintmax_t most_bytes = 1 << 24;
  if (std::filesystem::is_regular_file(path, missing) && std::filesystem::file_size(path) > most_bytes)
    throw SceneError(path, 0, "",
                     fmt::format("has {} bytes, more than the {} of any scene; grains go to a CSV file",
                                 std::filesystem::file_size(path), most_bytes));
  std::ifstream in(path);
  if (!in) throw SceneError(path, 0, "", "cannot open the scene: " + std::generic_category().message(errno));
  if (std::filesystem::is_directory(path)) throw SceneError(path, 0, "", "is a directory, not a scene file");
  std::ostringstream text;
  text << in.rdbuf();
  return parse_scene(text.str(), path, overrides);
}

}  // namespace talus::io
