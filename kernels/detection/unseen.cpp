#include "kernels/detection/unseen.hpp"

#include <algorithm>
#include <optional>
#include <vector>

#include "kernels/bodies/index.hpp"
#include "kernels/detection/ball_pairs.hpp"
#include "kernels/detection/images.hpp"
#include "kernels/detection/touch.hpp"
#include "kernels/detection/wall_pairs.hpp"

namespace talus {

namespace {

std::optional<FoundOverlap> deeper(const FoundOverlap& found, double least) {
  return found.depth > least * found.smaller_radius ? std::optional(found) : std::nullopt;
}

std::optional<FoundOverlap> overlap_of(const Poses& poses, const GrainPair& pair, BallNumbers balls,
                                       double least) {
  const Touch touch = touch_bodies(poses, pair.first, pair.second, balls);
  return deeper({pair.first, pair.second, -1, -touch.gap, touch.smaller_radius}, least);
}

/// None where a feature of a surface does not count for the ball that is near it (Surface::collide).
std::optional<FoundOverlap> overlap_of(const Poses& poses, const WallPair& pair, double least) {
  const Wall& wall = poses.walls[at(pair.wall)];
  const Touch touch = touch_wall(poses, wall, pair.body, pair.feature);
  const auto found = deeper({pair.body, -1, pair.wall, -touch.gap, touch.smaller_radius}, least);
  if (!found || wall.surface() == nullptr) return found;
  const auto balls = static_cast<std::int32_t>(poses.clumps.balls(at(pair.body)));
  std::vector<SurfacePoint> points;
  collide(wall, touch.ball.centre, touch.ball.radius, points);
  const bool counts = std::ranges::find(points, pair.feature / balls, &SurfacePoint::feature) != points.end();
  return counts ? found : std::nullopt;
}

/// Between spheres, the candidates that are no contacts stand behind the contacts (contacts.hpp).
void find_between_spheres(const Contacts& contacts, const Chunks& chunks, std::size_t chunk,
                          const Poses& poses, double least, const VisitOverlap& visit) {
  const std::size_t begin = at(chunks.begin[chunk]) + at(contacts.count[chunk]),
                    end = at(chunks.begin[chunk + 1]);
  poses.domain.with_space([&](const auto& space) {
    const Vec3* const x = poses.x.data();
    const double* const radius = poses.radius.data();
    const ContactBody *const first = contacts.first.data(), *const second = contacts.second.data();
    for (std::size_t k = begin; k < end; ++k) {
      const std::size_t i = at(first[k]), j = at(second[k]);
      double d[3] = {x[i][0] - x[j][0], x[i][1] - x[j][1], x[i][2] - x[j][2]};
      space.shorten(d[0], d[1], d[2]);
      const double sum = radius[i] + radius[j];
      if (d[0] * d[0] + d[1] * d[1] + d[2] * d[2] >= sum * sum) continue;
      const auto found = overlap_of(poses, {contacts.first[k], contacts.second[k]}, 0, least);
      if (found) visit(*found);
    }
  });
}

}  // namespace

void find_unseen_overlaps(const Candidates& candidates, const Contacts& contacts, const Chunks& chunks,
                          std::size_t chunk, const Poses& poses, double least, const VisitOverlap& visit) {
  if (chunks.kind[chunk] == ChunkKind::spheres) {
    find_between_spheres(contacts, chunks, chunk, poses, least, visit);
    return;
  }
  const std::size_t grains = candidates.grain_pairs.size();
  for (std::size_t k = at(chunks.begin[chunk]); k < at(chunks.begin[chunk + 1]); ++k) {
    const auto found = k < grains ? overlap_of(poses, candidates.grain_pairs[k], candidates.balls[k], least)
                                  : overlap_of(poses, candidates.wall_pairs[k - grains], least);
    if (found) visit(*found);
  }
}

void find_all_overlaps(const Poses& poses, std::span<const BodyId> id, const VisitOverlap& visit) {
  Candidates near;
  near.grain_pairs = near_pairs(poses.domain, poses.x, poses.radius);
  const std::vector<double> margin(poses.walls.size(), 0.0);
  near.wall_pairs = find_wall_pairs(poses.x, poses.radius, poses.walls, margin, poses.domain);
  split_into_balls(poses.clumps, near);
  for (std::size_t k = 0; k < near.grain_pairs.size(); ++k) {
    const GrainPair& pair = near.grain_pairs[k];
    if (id[at(pair.first)] == id[at(pair.second)]) continue;
    const auto found = overlap_of(poses, pair, near.balls.empty() ? BallNumbers{0} : near.balls[k], 0);
    if (found) visit(*found);
  }
  for (const WallPair& pair : near.wall_pairs)
    if (const auto found = overlap_of(poses, pair, 0)) visit(*found);
}

}  // namespace talus
