#include "kernels/detection/ball_pairs.hpp"

#include <algorithm>

#include "kernels/bodies/index.hpp"
#include "kernels/detection/touch.hpp"
#include "kernels/detection/wall_pairs.hpp"

namespace talus {

void split_into_balls(const ClumpView& clumps, Candidates& candidates) {
  if (clumps.shape.empty()) return;
  const std::vector<GrainPair> pairs = std::move(candidates.grain_pairs);
  candidates.grain_pairs.clear();
  candidates.balls.clear();
  for (const GrainPair& pair : pairs)
    for (std::size_t a = 0; a < clumps.balls(at(pair.first)); ++a)
      for (std::size_t b = 0; b < clumps.balls(at(pair.second)); ++b) {
        candidates.grain_pairs.push_back(pair);
        candidates.balls.push_back(ball_numbers(a, b));
      }
  std::vector<WallPair> at_walls;
  for (const WallPair& pair : candidates.wall_pairs) {
    const auto balls = static_cast<std::int32_t>(clumps.balls(at(pair.body)));
    for (std::int32_t ball = 0; ball < balls; ++ball)
      at_walls.push_back({pair.wall, pair.body, pair.feature * balls + ball});
  }
  candidates.wall_pairs.clear();
  for (const std::size_t k : layered_order(at_walls)) candidates.wall_pairs.push_back(at_walls[k]);
}

void note_kinds(const ClumpView& clumps, Chunks& chunks) {
  if (clumps.shape.empty()) return;
  for (std::size_t c = 0; c < chunks.size(); ++c) {
    const auto begin = chunks.bodies.begin() + chunks.body_begin[c],
               end = chunks.bodies.begin() + chunks.body_begin[c + 1];
    if (std::any_of(begin, end, [&](Slot slot) { return clumps.is_clump(at(slot)); }))
      chunks.kind[c] = ChunkKind::blocks;
  }
}

}  // namespace talus
