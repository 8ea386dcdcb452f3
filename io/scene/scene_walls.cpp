#include <algorithm>
#include <cmath>
#include <limits>

#include "io/scene/detail/probe_read.hpp"
#include "io/scene/detail/scene_keys.hpp"
#include "io/scene/detail/wall_conflict.hpp"
#include "io/scene/scene.hpp"
#include "runtime/step/cell.hpp"

namespace talus::io {

namespace detail {

std::string wall_conflict(const std::vector<Wall>& walls, std::size_t k) {
  constexpr double parallel = 1 - 1e-12;
  const auto always = [](const Wall& wall) { return wall.from_stage.empty() && wall.until_stage.empty(); };
  for (std::size_t j = 0; j < k; ++j) {
    if (!always(walls[j]) || !always(walls[k])) continue;
    const double cosine = walls[k].normal.dot(walls[j].normal);
    if (cosine > parallel)
      return fmt::format("walls '{}' and '{}' overlap: they face the same way", walls[j].name, walls[k].name);
    const double room = (walls[k].point - walls[j].point).dot(walls[j].normal);
    if (cosine < -parallel && room <= 0)
      return fmt::format("walls '{}' and '{}' cross: {} m of room between them", walls[j].name, walls[k].name,
                         room);
  }
  return "";
}

}  // namespace detail

namespace {

/// Coordinate of the face of an axis-aligned wall that nothing has placed yet: at the side of the bases of
/// the samples that have one, but never within a grain of several samples.
double automatic_position(const Wall& wall, int axis, const std::vector<SampleSpec>& samples,
                          const Sample& grains) {
  const bool low = wall.normal[axis] > 0;
  double face = low ? std::numeric_limits<double>::infinity() : -std::numeric_limits<double>::infinity();
  const auto reach = [&](double coordinate) {
    face = low ? std::min(face, coordinate) : std::max(face, coordinate);
  };
  for (const SampleSpec& sample : samples)
    if (axis < 2 && sample.base[0] > 0)
      reach(sample.origin[axis] + (low ? 0 : sample.base[static_cast<std::size_t>(axis)]));
  if (samples.size() == 1 && std::isfinite(face)) return face;
  for (std::size_t k = 0; k < grains.size(); ++k)
    reach(low ? grains.x[k][axis] - grains.radius[k] : grains.x[k][axis] + grains.radius[k]);
  return face;
}

/// How deep a centre lies in what is solid behind a wall [m]; 0 or less elsewhere.
double depth_behind(const Wall& wall, const Vec3& x) {
  return wall.surface() == nullptr ? wall.normal.dot(wall.point - x) : wall.surface()->depth(x);
}

/// What to do about a grain there.
std::string remedy_for(const Wall& wall) {
  if (wall.surface() == nullptr) return "move the grain, or the wall";
  return "the solid is there: move the grain out of it, or say with `inside` of the wall on which side of "
         "its surface the grains are";
}

void give_mass(WallLoad& load, double mass) {
  if (load.pushed() && load.mass == 0) load.mass = mass;
}

void give_masses(Setup& setup, double mass) {
  for (Wall& wall : setup.walls) give_mass(wall.load, mass);
  for (Stage& stage : setup.stages)
    for (auto& [name, load] : stage.loads) give_mass(load, mass);
}

void demand_room_in_cell(const Scene& scene, const Sample& grains) {
  if (!scene.setup.domain.repeats || grains.size() == 0) return;
  const auto [smallest, largest] = std::ranges::minmax(grains.radius);
  try {
    check_cell(scene.setup.domain, largest, candidate_margin(scene.setup.detection, smallest));
  } catch (const std::invalid_argument& error) {
    throw error_in(scene, "cell.lengths", error.what());
  }
}

}  // namespace

double automatic_wall_mass(const Sample& grains) {
  double mass = 0;
  for (std::size_t k = 0; k < grains.size(); ++k) mass += talus::mass(grains, k);
  return 0.1 * mass;
}

void place_walls_again(Scene& scene, const PlacedThen& then) {
  const auto& [points, mass, named] = then;
  std::vector<Wall>& walls = scene.setup.walls;
  if (points.size() != 3 * walls.size()) throw error_in(scene, "wall", "the checkpoint is of other walls");
  if (named.size() != scene.setup.named.size())
    throw error_in(scene, "sample", "the checkpoint is of other bodies");
  for (std::size_t k = 0; k < named.size(); ++k) scene.setup.named[k].id = BodyId{named[k]};
  for (std::size_t w = 0; w < walls.size(); ++w)
    walls[w].point = {points[3 * w], points[3 * w + 1], points[3 * w + 2]};
  give_masses(scene.setup, mass);
  try {
    validate(scene.setup);
  } catch (const std::invalid_argument& error) {
    throw error_in(scene, "", error.what());
  }
}

void place_walls(Scene& scene, const Sample& grains) {
  const auto refuse = [&](const std::string& message) { throw error_in(scene, "wall", message); };
  if (grains.size() == 0 && scene.setup.inserts.empty())
    throw error_in(scene, "sample", "there are no grains");
  for (std::size_t k = 0; k < grains.named.size(); ++k) scene.setup.named.at(k).id = grains.named[k];
  std::vector<Wall>& walls = scene.setup.walls;
  for (Wall& wall : walls)
    if (const int axis = detail::axis_of(wall); axis >= 0 && std::isnan(wall.point[axis]))
      wall.point[axis] = automatic_position(wall, axis, scene.samples, grains);
  for (const Wall& wall : walls)
    if (wall.surface() == nullptr && !wall.point.allFinite())
      refuse(fmt::format("wall '{}' needs a position: no grains are there yet to place it by", wall.name));

  give_masses(scene.setup, automatic_wall_mass(grains));
  demand_room_in_cell(scene, grains);

  for (std::size_t k = 0; k < walls.size(); ++k)
    if (const std::string fault = detail::wall_conflict(walls, k); !fault.empty()) refuse(fault);
  for (const ProbeRule& probe : scene.setup.probes)
    if (const std::string fault = detail::probe_fault(probe, walls); !fault.empty())
      throw error_in(scene, "probe", fault);
  for (const Wall& wall : walls)
    for (std::size_t k = 0; stands_at_first(scene.setup, wall) && k < grains.size(); ++k)
      if (const double depth = depth_behind(wall, grains.x[k]); depth > 0)
        refuse(fmt::format("the centre of grain {} lies {:.6g} m behind wall '{}'; {}",
                           static_cast<std::int64_t>(grains.id_of(k)), depth, wall.name, remedy_for(wall)));
  try {
    validate(scene.setup);
  } catch (const std::invalid_argument& error) {
    throw error_in(scene, "", error.what());
  }
}

}  // namespace talus::io
