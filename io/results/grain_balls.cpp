#include "io/results/grain_balls.hpp"

#include <algorithm>

#include "io/files/error.hpp"
#include "io/results/results.hpp"

namespace talus::io {

GrainShapes grain_shapes(std::span<const Clump> clumps, bool inserts, const std::filesystem::path& results) {
  GrainShapes shapes;
  if (clumps.empty()) return shapes;
  shapes.clump = clumps.front();
  if (!inserts || !std::filesystem::exists(results)) return shapes;
  try {
    if (frame_count(results) == 0) return shapes;
    const Frame first = read_frame(results, 0, FrameParts::places);
    shapes.spheres_from = first.id.empty() ? 0 : std::ranges::max(first.id) + 1;
    // Who has come since then cannot be told from who was there.
    if (first.step > 0) shapes.clump.reset();
  } catch (const FileError&) {  // a picture need not end the run
    shapes.clump.reset();
  }
  return shapes;
}

GrainShapes grain_shapes(std::span<const Clump> clumps, bool inserts, const std::filesystem::path& results,
                         const graph::Communicator& ranks) {
  GrainShapes shapes;
  if (clumps.empty()) return shapes;
  if (ranks.rank() == 0) shapes = grain_shapes(clumps, inserts, results);
  std::int64_t found[2] = {ranks.rank() == 0 && shapes.clump ? 1 : 0,
                           ranks.rank() == 0 ? shapes.spheres_from : 0};
  ranks.sum(found);
  shapes.spheres_from = found[1];
  shapes.clump.reset();
  if (found[0] > 0) shapes.clump = clumps.front();
  return shapes;
}

void add_balls(const Frame& frame, const GrainShapes& shapes, std::size_t grain,
               std::vector<SeenBall>& balls) {
  const Vec3& x = frame.x[grain];
  const double radius = frame.radius[grain];
  if (!shapes.clump || frame.orientation.empty() || frame.id[grain] >= shapes.spheres_from) {
    balls.push_back({x, radius, grain});
    return;
  }
  const Mat3 turned = rotation_of(frame.orientation[grain]);
  for (const Ball& ball : shapes.clump->balls)
    balls.push_back({x + radius * (turned * ball.centre), radius * ball.radius, grain});
}

std::vector<SeenBall> seen_balls(const Frame& frame, const GrainShapes& shapes) {
  std::vector<SeenBall> balls;
  balls.reserve(frame.id.size() * (shapes.clump ? shapes.clump->balls.size() : 1));
  for (std::size_t k = 0; k < frame.id.size(); ++k) add_balls(frame, shapes, k, balls);
  return balls;
}

Frame frame_of_balls(const Frame& frame, const GrainShapes& shapes) {
  Frame result;
  result.step = frame.step, result.time = frame.time, result.stage = frame.stage;
  result.walls = frame.walls, result.domain = frame.domain;
  result.with_contacts = false;
  for (const auto& [centre, radius, grain] : seen_balls(frame, shapes)) {
    result.id.push_back(frame.id[grain]);
    result.x.push_back(centre);
    result.radius.push_back(radius);
    const Vec3 arm = centre - frame.x[grain];
    if (!frame.u.empty())
      result.u.push_back(frame.omega.empty() ? frame.u[grain]
                                             : Vec3(frame.u[grain] + frame.omega[grain].cross(arm)));
    if (!frame.omega.empty()) result.omega.push_back(frame.omega[grain]);
    if (!frame.orientation.empty()) result.orientation.push_back(frame.orientation[grain]);
    if (!frame.material.empty()) result.material.push_back(frame.material[grain]);
  }
  return result;
}

}  // namespace talus::io
