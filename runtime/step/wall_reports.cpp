#include "runtime/step/wall_reports.hpp"

#include <Eigen/Geometry>
#include <optional>

#include "runtime/step/wall_motions.hpp"

namespace talus {

std::vector<WallReport> wall_reports(const StepState& state, double impulse_time) {
  std::vector<WallReport> reports;
  for (std::size_t w = 0; w < state.walls.size(); ++w) {
    const Wall& wall = state.walls[w];
    const WallState& of = state.wall_states[w];
    reports.push_back({wall.name, wall.normal.dot(wall.point), wall.normal.dot(wall.velocity),
                       of.impulse / impulse_time, of.torque / impulse_time, of.work,
                       wall.surface() == nullptr ? wall.normal : Vec3(Vec3::Zero()), wall.pose, wall.absent});
  }
  return reports;
}

std::vector<WallReport> group_reports(const Setup& setup, const StepState& state,
                                      std::span<const WallReport> walls) {
  std::vector<WallReport> reports;
  for (const WallGroup& group : setup.groups) {
    WallReport& sum = reports.emplace_back();
    sum.name = group.name;
    std::optional<Vec3> about;
    for (std::size_t w = 0; w < walls.size(); ++w) {
      const WallState& of = state.wall_states[w];
      if (state.walls[w].group != group.name) continue;
      if (!about) about = point_of_group(group, of);
      sum.force += walls[w].force;
      sum.torque += walls[w].torque + (of.own_point - *about).cross(walls[w].force);
      sum.work += walls[w].work;
    }
  }
  return reports;
}

}  // namespace talus
