#include "runtime/step/appearing_walls.hpp"

#include <fmt/format.h>

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/step/runaway.hpp"

namespace talus {

namespace {

/// The grain that lies deepest in a solid and touches its surface nowhere.
struct Deepest {
  double depth = 0;  ///< [m]
  std::int64_t body = 0;
};

Deepest deeper(const Deepest& a, const Deepest& b) {
  const bool first = a.depth > b.depth || (a.depth == b.depth && a.body <= b.body);
  return first ? a : b;
}

Deepest deepest_in(const Wall& wall, const StepState& state) {
  const ClumpView clumps{state.bodies.shape, state.bodies.orientation, state.clumps};
  Deepest deepest;
  const Bounds bounds = wall.surface()->bounds();
  std::vector<SurfacePoint> points;
  for (std::size_t s = 0; s < state.bodies.size(); ++s)
    for (std::size_t ball = 0; ball < clumps.balls(s); ++ball) {
      const auto [centre, radius] = ball_of(clumps, s, ball, state.bodies.x[s], state.bodies.radius[s]);
      // What lies far outside of a container is in its solid, too, but does not meet it.
      const Vec3 in_place = wall.pose.back(centre);
      const double depth = bounds.near(in_place, radius) ? wall.surface()->depth(in_place) : 0;
      points.clear();
      if (depth > 0) collide(wall, centre, radius, points);
      if (depth > 0 && points.empty())
        deepest = deeper(deepest, {depth, static_cast<std::int64_t>(state.bodies.id[s])});
    }
  return deepest;
}

}  // namespace

void demand_grains_outside(const Stage& stage, const std::string& step, const StepState& state,
                           const graph::Communicator& ranks) {
  for (const Wall& wall : state.walls) {
    if (wall.surface() == nullptr || wall.from_stage.empty() || wall.from_stage != stage.name) continue;
    const Deepest own = deepest_in(wall, state);
    Deepest all;
    for (const Deepest& of_rank : ranks.gather_records(std::span<const Deepest>(&own, 1)))
      all = deeper(all, of_rank);
    if (all.depth > 0)
      throw RunawayError(fmt::format(
          "{}: wall '{}' appears where grains are: the centre of grain {}, or of a ball of it, lies {:.6g} m "
          "inside its solid, from where no contact would push it out. Remove such grains as the stage begins "
          "or before ([[remove]]), or let the wall appear in another place",
          step, wall.name, all.body, all.depth));
  }
}

}  // namespace talus
