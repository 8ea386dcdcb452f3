#include "kernels/detection/wall_pairs.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <random>
#include <set>
#include <utility>

#include "kernels/detection/chunks.hpp"

namespace talus {
namespace {

/// Pairs of 2 walls and 5 bodies with up to 4 features each, shuffled, each with its own impulse.
Candidates shuffled_pairs(unsigned seed) {
  std::mt19937 random(seed);
  Candidates candidates;
  for (std::int32_t wall = 0; wall < 2; ++wall)
    for (Slot body = 0; body < 5; ++body)
      for (std::int32_t feature = 0; feature < 9; ++feature)
        if (random() % 2 == 0) candidates.wall_pairs.push_back({wall, body, feature});
  std::ranges::shuffle(candidates.wall_pairs, random);
  for (const WallPair& pair : candidates.wall_pairs)
    candidates.impulse.push_back(std::vector<double>{100.0 * pair.wall + pair.body, 1.0 * pair.feature, 1});
  return candidates;
}

std::vector<Slot> as_they_are() {
  std::vector<Slot> place(5);
  std::iota(place.begin(), place.end(), 0);
  return place;
}

TEST(WallPairs, ALayerHasNoBodyTwice) {
  Candidates candidates = shuffled_pairs(1);
  renumber(candidates, as_they_are());
  const auto groups = groups_of_one_subdomain(candidates, {}, 64);
  std::map<std::pair<std::int32_t, Slot>, std::size_t> features;
  for (const WallPair& pair : candidates.wall_pairs) ++features[{pair.wall, pair.body}];
  std::size_t layers[2] = {0, 0};
  for (const auto& [place, count] : features) {
    auto& most = layers[static_cast<std::size_t>(place.first)];
    most = std::max(most, count);
  }
  EXPECT_EQ(groups.size(), layers[0] + layers[1]) << "as many as the grain with most features has";
  for (const CandidateGroup& group : groups) {
    std::set<Slot> bodies;
    for (std::int32_t k = group.begin; k < group.end; ++k) {
      const WallPair& pair = candidates.wall_pairs[static_cast<std::size_t>(k)];
      EXPECT_EQ(pair.wall, group.wall);
      EXPECT_TRUE(bodies.insert(pair.body).second) << "body " << pair.body << " twice";
    }
  }
}

TEST(WallPairs, ImpulsesFollowTheirFeaturesWhateverTheLayers) {
  Candidates old = shuffled_pairs(2), fresh = shuffled_pairs(3);
  renumber(old, as_they_are());
  renumber(fresh, as_they_are());
  match_impulses(old, fresh);
  std::size_t kept = 0;
  for (std::size_t k = 0; k < fresh.wall_pairs.size(); ++k) {
    const WallPair& pair = fresh.wall_pairs[k];
    const bool known = std::ranges::find(old.wall_pairs, pair) != old.wall_pairs.end();
    kept += known;
    EXPECT_EQ(fresh.impulse.row(k)[0], known ? 100 * pair.wall + pair.body : 0);
    EXPECT_EQ(fresh.impulse.row(k)[1], known ? pair.feature : 0);
  }
  EXPECT_GT(kept, 5u);
  EXPECT_LT(kept, fresh.wall_pairs.size());
}

TEST(WallPairs, OfAPlaneStandInTheOrderOfTheirBodies) {
  Wall floor;
  const std::vector<Wall> walls{floor};
  const std::vector<Vec3> x{{0, 0, 0.4}, {0, 0, 2}, {0, 0, 0.2}};
  const std::vector<double> reach{0.5, 0.5, 0.5}, margin{0.1};
  const std::vector<WallPair> expected{{0, 0}, {0, 2}};
  EXPECT_EQ(find_wall_pairs(x, reach, walls, margin), expected);
}

}  // namespace
}  // namespace talus
