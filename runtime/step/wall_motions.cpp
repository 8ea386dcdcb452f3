#include "runtime/step/wall_motions.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "runtime/step/runaway.hpp"

namespace talus {

namespace {

/// Calls visit(corner) for the corners of the box around a surface, in its first place.
template <class Visit>
void each_corner(const Surface& surface, const Visit& visit) {
  const Bounds box = surface.bounds();
  for (int k = 0; k < 8; ++k)
    visit(Vec3((k & 1) != 0 ? box.high[0] : box.low[0], (k & 2) != 0 ? box.high[1] : box.low[1],
               (k & 4) != 0 ? box.high[2] : box.low[2]));
}

/// Velocities in a step from `time` on: between the middles of this step and the next one, of length h.
void set_velocities(double time, double h, Wall& wall) {
  const RigidVelocity mean = mean_velocity(wall.motion, time + 0.5 * h, h);
  wall.velocity = mean.velocity;
  wall.omega = mean.omega;
  wall.pivot = mean.pivot;
  wall.belt = mean_surface_velocity(wall.motion, time + 0.5 * h, h, mean.pivot);
}

/// When a stage began; infinity if it has not begun yet.
double begin_of(const Setup& setup, const std::string& name, std::span<const double> stage_begins) {
  for (std::size_t k = 0; k < stage_begins.size(); ++k)
    if (setup.stages[k].name == name) return stage_begins[k];
  return std::numeric_limits<double>::infinity();
}

bool turns(const Wall& wall) {
  return wall.omega != Vec3::Zero() || wall.belt.omega != Vec3::Zero();
}

/// Distance of the farthest grain from the pivot of a plane, with its radius. Collective.
void find_farthest(StepState& state, const graph::Communicator& ranks) {
  std::vector<double> farthest(state.walls.size(), 0.0);
  for (std::size_t w = 0; w < state.walls.size(); ++w) {
    const Wall& wall = state.walls[w];
    if (wall.surface() != nullptr || !turns(wall)) continue;
    for (std::size_t s = 0; s < state.bodies.size(); ++s)
      farthest[w] = std::max(farthest[w], (state.bodies.x[s] - wall.pivot).norm() + state.bodies.radius[s]);
  }
  ranks.max(farthest);
  for (std::size_t w = 0; w < farthest.size(); ++w) state.wall_states[w].farthest = farthest[w];
}

void find_speeds(const Wall& wall, WallState& state) {
  if (wall.surface() == nullptr) {
    // Along the normal: what else a plane does brings no grain nearer.
    state.speed =
        std::abs(wall.normal.dot(wall.velocity)) + wall.normal.cross(wall.omega).norm() * state.farthest;
    state.material_speed = wall.velocity.norm() + wall.belt.velocity.norm() +
                           (wall.omega.norm() + wall.belt.omega.norm()) * state.farthest;
    return;
  }
  state.speed = state.material_speed = 0;
  each_corner(*wall.surface(), [&](const Vec3& corner) {
    const Vec3 c = state.middle.of(corner);
    state.speed = std::max(state.speed, wall.velocity_at(c).norm());
    state.material_speed = std::max(state.material_speed, (wall.velocity_at(c) + wall.belt.at(c)).norm());
  });
}

void demand_rows(const Wall& wall, double time, double h, const std::string& step) {
  for (const MotionPart& part : wall.motion) {
    if (!part.table || !(part.begin < time + h) || !(time < part.end)) continue;
    const double asked = std::min(time + h, part.end) - part.begin;
    // Times of steps are sums: a stage may end later than the table by their rounding.
    if (asked > part.table->end() + 1e-6 * h)
      throw RunawayError(
          fmt::format("{}: the motion of wall '{}' ends at {} s in its table {}, and the step at {} s of it. "
                      "Give the table more rows, the stage an earlier end, or the motion an until_stage",
                      step, wall.name, part.table->end(), part.file, asked));
  }
}

}  // namespace

void simplify_motions(std::span<Wall> walls) {
  for (Wall& wall : walls) {
    const auto rotation = std::ranges::find_if(wall.motion, &MotionPart::turns);
    if (!wall.torque_point.allFinite()) {
      if (rotation != wall.motion.end())
        wall.torque_point = rotation->point;
      else if (wall.surface() == nullptr)
        wall.torque_point = wall.point;
      else
        wall.torque_point = 0.5 * (wall.surface()->bounds().low + wall.surface()->bounds().high);
    }
    if (wall.surface() == nullptr) continue;
    const bool itself = std::ranges::all_of(wall.motion, [&](const MotionPart& part) {
      return !part.turns() || wall.surface()->turns_in_itself(part.axis, part.point);
    });
    for (MotionPart& part : wall.motion)
      if (itself && part.turns() && part.kind == MotionPart::Kind::rotation) part.surface_only = true;
  }
}

void resolve_stages(const Setup& setup, std::size_t stage, std::span<const double> stage_begins,
                    std::span<Wall> walls) {
  const auto begun = [&](const std::string& name) {
    return std::ranges::any_of(std::span(setup.stages).first(stage + 1),
                               [&](const Stage& other) { return other.name == name; });
  };
  for (Wall& wall : walls) {
    wall.absent = (!wall.from_stage.empty() && !begun(wall.from_stage)) ||
                  (!wall.until_stage.empty() && begun(wall.until_stage));
    for (MotionPart& part : wall.motion) {
      if (!part.from_stage.empty()) part.begin = begin_of(setup, part.from_stage, stage_begins);
      if (!part.until_stage.empty()) part.end = begin_of(setup, part.until_stage, stage_begins);
    }
  }
}

void set_walls(const Setup& setup, double time, double h, StepState& state) {
  for (std::size_t w = 0; w < state.walls.size(); ++w) {
    Wall& wall = state.walls[w];
    if (wall.motion.empty()) continue;
    place(setup.walls[w], pose_at(wall.motion, time), wall);
    set_velocities(time, h, wall);
  }
}

void demand_motion(double time, double h, const std::string& step, std::span<const Wall> walls) {
  for (const Wall& wall : walls) demand_rows(wall, time, h, step);
}

namespace {

/// The velocity at which a wall comes, in h, as far as it has since the middle of a step before, of length
/// `before`.
RigidVelocity came_since(const Wall& wall, double time, double h, double before) {
  const double since = 0.5 * (before + h);
  RigidVelocity came = mean_velocity(wall.motion, time - 0.5 * before, since);
  came.velocity *= since / h;
  came.omega *= since / h;
  return came;
}

}  // namespace

void prepare_walls(double time, double h, double before, StepState& state, const graph::Communicator& ranks) {
  if (std::ranges::all_of(state.walls, [](const Wall& wall) { return wall.motion.empty(); })) return;
  bool planes_turn = false;
  for (std::size_t w = 0; w < state.walls.size(); ++w) {
    Wall& wall = state.walls[w];
    if (wall.motion.empty()) continue;
    set_velocities(time, h, wall);
    wall.came = came_since(wall, time, h, before);
    state.wall_states[w].middle = pose_at(wall.motion, time + 0.5 * h);
    state.wall_states[w].end = pose_at(wall.motion, time + h);
    planes_turn |= wall.surface() == nullptr && turns(wall);
  }
  if (planes_turn) find_farthest(state, ranks);
  for (std::size_t w = 0; w < state.walls.size(); ++w)
    if (!state.walls[w].motion.empty()) find_speeds(state.walls[w], state.wall_states[w]);
}

double way_since(const Wall& first, const Wall& wall, const WallState& state, double then) {
  const Pose before = pose_at(wall.motion, then);
  if (wall.surface() == nullptr) {
    Wall old;
    place(first, before, old);
    return std::abs(old.normal.dot(wall.point - old.point)) +
           (wall.normal - old.normal).norm() * (state.farthest + (wall.point - wall.pivot).norm());
  }
  double way = 0;
  each_corner(*wall.surface(), [&](const Vec3& corner) {
    way = std::max(way, (wall.pose.of(corner) - before.of(corner)).norm());
  });
  return way;
}

Vec3 own_point(const Wall& first, const Wall& wall, const Pose& pose) {
  if (!wall.motion.empty()) return pose.of(wall.torque_point);
  return wall.torque_point + (wall.point - first.point);
}

Vec3 point_of_group(const WallGroup& group, const WallState& state) {
  if (group.torque_point.allFinite()) return state.middle.of(group.torque_point);
  const auto turning = std::ranges::find_if(group.motion, &MotionPart::turns);
  return turning != group.motion.end() ? state.middle.of(turning->point) : state.own_point;
}

}  // namespace talus
