/// Candidates of clumps: one per pair of balls, whose impulses follow them.

#include "kernels/detection/ball_pairs.hpp"

#include <gtest/gtest.h>

#include <map>
#include <tuple>

#include "kernels/detection/touch.hpp"
#include "kernels/shapes/body_shapes.hpp"

namespace talus {
namespace {

/// Bodies 0 and 2 are rods of three balls, 1 is a sphere, 3 a dumbbell.
struct FourBodies {
  std::vector<Clump> clumps{body_shapes().named("rod").make(), body_shapes().named("dumbbell").make()};
  std::vector<ShapeNumber> shape{1, 0, 1, 2};
  std::vector<std::array<double, 4>> orientation{4, {1, 0, 0, 0}};
  ClumpView view() const { return {shape, orientation, clumps}; }

  static Candidates pairs() {
    Candidates candidates;
    candidates.grain_pairs = {{0, 1}, {0, 2}, {1, 3}, {2, 3}};
    candidates.wall_pairs = {{0, 1}, {0, 2}, {1, 3}};
    return candidates;
  }
};

TEST(BallPairs, AreAllThatMayTouch) {
  const FourBodies bodies;
  Candidates candidates = FourBodies::pairs();
  split_into_balls(bodies.view(), candidates);
  EXPECT_EQ(candidates.grain_pairs.size(), 3u + 9 + 2 + 6);
  ASSERT_EQ(candidates.balls.size(), candidates.grain_pairs.size());
  std::map<std::tuple<Slot, Slot, int>, int> seen;
  for (std::size_t k = 0; k < candidates.balls.size(); ++k)
    ++seen[{candidates.grain_pairs[k].first, candidates.grain_pairs[k].second, candidates.balls[k]}];
  EXPECT_EQ(seen.size(), candidates.grain_pairs.size()) << "one comes twice";
  EXPECT_TRUE(seen.contains({2, 3, ball_numbers(2, 1)}));
  // By (wall, layer, body): the sphere and the first ball of the rod, then the other balls, one a layer.
  const std::vector<WallPair> expected = {{0, 1, 0}, {0, 2, 0}, {0, 2, 1}, {0, 2, 2}, {1, 3, 0}, {1, 3, 1}};
  EXPECT_EQ(candidates.wall_pairs, expected);
}

TEST(BallPairs, LeaveSpheresAlone) {
  Candidates candidates = FourBodies::pairs();
  split_into_balls({}, candidates);
  EXPECT_EQ(candidates.grain_pairs, FourBodies::pairs().grain_pairs);
  EXPECT_EQ(candidates.wall_pairs, FourBodies::pairs().wall_pairs);
  EXPECT_TRUE(candidates.balls.empty());
}

TEST(BallPairs, KeepTheirImpulsesWhereBodiesAreFoundAnewOrSorted) {
  const FourBodies bodies;
  Candidates old = FourBodies::pairs();
  split_into_balls(bodies.view(), old);
  for (std::size_t k = 0; k < old.size(); ++k)
    old.impulse.push_back(std::vector<double>(3, static_cast<double>(10 * k + 1)));
  Candidates fresh = FourBodies::pairs();
  std::erase(fresh.grain_pairs, GrainPair{0, 2});
  split_into_balls(bodies.view(), fresh);
  // Between ranks only those with an impulse travel.
  Candidates sent;
  for (std::size_t k = 0; k < old.size(); ++k) {
    if (k < old.grain_pairs.size() && k % 3 == 1) continue;
    if (k < old.grain_pairs.size()) {
      sent.grain_pairs.push_back(old.grain_pairs[k]);
      sent.balls.push_back(old.balls[k]);
    } else {
      sent.wall_pairs.push_back(old.wall_pairs[k - old.grain_pairs.size()]);
    }
    sent.impulse.push_back(old.impulse.row(k));
  }
  match_impulses(sent, fresh);
  for (std::size_t k = 0; k < fresh.grain_pairs.size(); ++k) {
    std::size_t was = 0;
    while (!(old.grain_pairs[was] == fresh.grain_pairs[k]) || old.balls[was] != fresh.balls[k]) ++was;
    EXPECT_EQ(fresh.impulse.row(k)[0], was % 3 == 1 ? 0 : old.impulse.row(was)[0]) << k;
  }

  // Bodies 2 and 3 change places: the dumbbell comes first, its ball is that of the first body now.
  const std::vector<Slot> place = {0, 1, 3, 2};
  Candidates sorted = old;
  renumber(sorted, place);
  for (std::size_t k = 0; k < old.grain_pairs.size(); ++k) {
    Slot a = place[static_cast<std::size_t>(old.grain_pairs[k].first)],
         b = place[static_cast<std::size_t>(old.grain_pairs[k].second)];
    std::size_t one = old.balls[k] / 256u, other = old.balls[k] % 256u;
    double sign = 1;
    if (a > b) {
      std::swap(a, b);
      std::swap(one, other);
      sign = -1;
    }
    std::size_t now = 0;
    while (!(sorted.grain_pairs[now] == GrainPair{a, b}) || sorted.balls[now] != ball_numbers(one, other)) {
      ASSERT_LT(++now, sorted.grain_pairs.size()) << "lost: pair " << k;
    }
    EXPECT_EQ(sorted.impulse.row(now)[0], sign * old.impulse.row(k)[0]);
    const bool same_bodies = now > 0 && sorted.grain_pairs[now] == sorted.grain_pairs[now - 1];
    EXPECT_TRUE(!same_bodies || sorted.balls[now - 1] < sorted.balls[now]) << "not sorted";
  }
}

}  // namespace
}  // namespace talus
