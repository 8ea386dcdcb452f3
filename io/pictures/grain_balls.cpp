#include "io/pictures/grain_balls.hpp"

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

}  // namespace talus::io
