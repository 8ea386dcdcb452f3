#include "apps/study_certificate/unexplained_shift.hpp"

#include <algorithm>
#include <vector>

#include "apps/study_certificate/step_walls.hpp"
#include "kernels/bodies/larger.hpp"

namespace talus::audit {

namespace {

/// What may shift a grain.
struct Granted {
  double place = 1e-12;     ///< of a grain's distance from the origin and its way: what rounding shifts it by
  double corrected = 1e-7;  ///< of the largest radius: shifts that a solve of overlaps, an iteration, leaves
  double undone = 2;        ///< of what is undone of all overlaps: how far that may shift a grain
};
constexpr Granted granted;

}  // namespace

UnexplainedShift unexplained_shift(const StepInput& input, double part, const Frame& after) {
  if (input.before.domain.repeats) return {};
  const Frame& before = input.before;
  const double h = input.stage.time_step;
  const std::size_t grains = after.x.size();
  std::vector<Vec3> middle, moved;
  double way = 0, size = 0, largest = 0, overlaps = 0;
  for (std::size_t k = 0; k < grains; ++k) {
    middle.push_back(before.x[k] + h / 2 * before.u[k]);
    moved.push_back(middle[k] + h / 2 * after.u[k]);
    way = larger(way, (after.x[k] - moved[k]).norm());
    largest = std::max(largest, after.radius[k]);
    size = std::max(size, after.x[k].norm() + (moved[k] - before.x[k]).norm());
  }
  for (std::size_t i = 0; i < grains && part > 0; ++i)
    for (std::size_t j = 0; j < i; ++j) {
      const double least = std::min((middle[i] - middle[j]).norm(), (moved[i] - moved[j]).norm());
      overlaps += std::max(0.0, after.radius[i] + after.radius[j] - least);
    }
  for (std::size_t w = 0; w < input.walls.size() && part > 0; ++w) {
    const StepWall wall(input.walls[w], before.time, h);
    if (!wall.there()) continue;
    Placement half = wall.placed(h / 2), end = wall.placed(h);
    if (!wall.moves()) {  // a load may have changed its speed
      end.shift = (after.walls[w].position - before.walls[w].position) * input.walls[w].normal;
      half.shift = end.shift / 2;
    }
    for (std::size_t i = 0; i < grains; ++i)
      overlaps += std::max(wall.overlap(middle[i], after.radius[i], half),
                           wall.overlap(moved[i], after.radius[i], end));
  }
  return {way, part * (granted.undone * overlaps + granted.corrected * largest) + granted.place * size};
}

}  // namespace talus::audit
