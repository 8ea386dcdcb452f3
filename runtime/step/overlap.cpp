#include "runtime/step/overlap.hpp"

#include <algorithm>
#include <span>
#include <utility>

#include "kernels/detection/measures.hpp"
#include "kernels/detection/touch.hpp"
#include "kernels/detection/unseen.hpp"
#include "runtime/step/state.hpp"
#include "runtime/step/used_reach.hpp"

namespace talus {

namespace {

BodyPair pair_of(const StepState& state, Slot first, Slot second, std::int32_t wall) {
  const auto id = [&](Slot slot) {
    return static_cast<std::int64_t>(state.bodies.id[static_cast<std::size_t>(slot)]);
  };
  return wall >= 0 ? BodyPair::at_wall(id(first), wall) : BodyPair::of_bodies(id(first), id(second));
}
BodyPair pair_of(const StepState& state, std::size_t k, std::int32_t wall) {
  return pair_of(state, state.contacts.first[k], state.contacts.second[k], wall);
}

/// An overlap over the smaller radius, and its pair.
struct RankedOverlap {
  double depth = 0;
  BodyPair pair;
};
/// The deeper one, and of two as deep that of the first pair.
void keep_worse(const RankedOverlap& other, RankedOverlap& worst) {
  if (other.depth != worst.depth ? other.depth > worst.depth : other.pair < worst.pair) worst = other;
}

/// Calls visit(k, wall index or -1, touch) for each contact of this rank, with the present poses.
template <class Visit>
void for_each_touch(const StepState& state, const Visit& visit) {
  const Poses poses = poses_of(state);
  for (std::size_t c = 0; c < state.chunks.size(); ++c) {
    const std::int32_t wall = state.chunks.wall[c];
    const Wall* const surface = wall < 0 ? nullptr : &state.walls[static_cast<std::size_t>(wall)];
    const auto begin = static_cast<std::size_t>(state.chunks.begin[c]);
    for (std::size_t k = begin; k < begin + static_cast<std::size_t>(state.contacts.count[c]); ++k)
      visit(k, wall, touch_of(poses, state.contacts, k, surface));
  }
}

/// The deepest overlap of each pair, in order of the pairs: bodies may touch in several points.
std::vector<GivenOverlap> deepest_of_pairs(std::vector<GivenOverlap> all) {
  std::ranges::sort(all, [](const GivenOverlap& a, const GivenOverlap& b) {
    return a.pair != b.pair ? a.pair < b.pair : a.depth > b.depth;
  });
  // Not std::ranges::unique: clang 14 does not take libstdc++'s subrange.
  const auto same = [](const GivenOverlap& a, const GivenOverlap& b) { return a.pair == b.pair; };
  all.erase(std::unique(all.begin(), all.end(), same), all.end());
  return all;
}

std::vector<GivenOverlap> gathered(std::span<const GivenOverlap> part, const graph::Communicator& ranks) {
  return deepest_of_pairs(ranks.gather_records(part));
}

double given_to(const std::vector<GivenOverlap>& given, const BodyPair& pair) {
  const auto found = std::ranges::lower_bound(given, pair, {}, &GivenOverlap::pair);
  return found != given.end() && found->pair == pair ? found->depth : 0;
}

}  // namespace

std::vector<GivenOverlap> given_overlaps(const StepState& state, const StepParameters& parameters,
                                         double tolerance, const graph::Communicator& ranks,
                                         const OverlapThresholds& thresholds) {
  const auto velocity = [&](Slot slot) -> Vec3 {
    return Eigen::Map<const Vec3>(state.bodies.velocity[static_cast<std::size_t>(slot)].u);
  };
  std::vector<GivenOverlap> given;
  for_each_touch(state, [&](std::size_t k, std::int32_t wall, const Touch& touch) {
    const auto x = [&](Slot slot) -> const Vec3& { return state.bodies.x[static_cast<std::size_t>(slot)]; };
    const Slot first = state.contacts.first[k], second = state.contacts.second[k];
    const Vec3 other = wall < 0 ? Vec3(velocity(second) + state.domain.image_velocity(x(first), x(second)))
                                : state.walls[static_cast<std::size_t>(wall)].velocity_at(touch.point);
    const Vec3 way = 0.5 * parameters.time_step * (velocity(state.contacts.first[k]) - other);
    // Holds where separation and normal are parallel, as in overlaps that do not reach a centre.
    const double then =
        wall < 0 ? (touch.separation - way).norm() - touch.separation.norm() : -touch.normal.dot(way);
    const double depth = -(touch.gap + then);
    if (depth > thresholds.negligible * tolerance * touch.smaller_radius)
      given.push_back({pair_of(state, k, wall), depth});
  });
  return gathered(given, ranks);
}

DeepestOverlap find_deepest_overlap(StepState& state, const OverlapSums& sums, double tolerance,
                                    const graph::Communicator& ranks) {
  const std::vector<GivenOverlap> given = *state.given_overlaps;
  const bool beyond = sums.bodies_beyond || sums.walls_beyond,
             looks = sums.deepest > tolerance || !given.empty();
  if (!looks && !beyond) return {sums.deepest, false, {}};
  RankedOverlap worst{looks ? 0 : sums.deepest, {}};
  const auto consider = [&](const BodyPair& pair, double depth, double smaller_radius, double before) {
    keep_worse({(depth - before) / smaller_radius, pair}, worst);
  };
  if (looks) {
    std::vector<GivenOverlap> left;
    for_each_touch(state, [&](std::size_t k, std::int32_t wall, const Touch& touch) {
      if (!(touch.gap < 0)) return;
      const BodyPair pair = pair_of(state, k, wall);
      const double before = given_to(given, pair);
      if (before > 0) left.push_back({pair, std::min(before, -touch.gap)});
      consider(pair, -touch.gap, touch.smaller_radius, before);
    });
    if (!given.empty()) state.given_overlaps = gathered(left, ranks);
  }
  // A pair that has parted, and was no contact, has its gift no more.
  const auto consider_unseen = [&](const BodyPair& pair, double depth, double smaller_radius) {
    const bool keeps = given_to(*state.given_overlaps, pair) > 0;
    consider(pair, depth, smaller_radius, keeps ? given_to(given, pair) : 0);
  };
  const Poses poses = poses_of(state);
  for (std::size_t c = 0; looks && c < state.chunks.size(); ++c)
    find_unseen_overlaps(state.candidates, state.contacts, state.chunks, c, poses, 0,
                         [&](const FoundOverlap& found) {
                           consider_unseen(pair_of(state, found.first, found.second, found.wall), found.depth,
                                           found.smaller_radius);
                         });
  if (beyond)
    for (const PairOverlap& found : overlaps_with_others(state, sums.walls_beyond, ranks))
      consider_unseen(found.pair, found.depth, found.smaller_radius);
  for (const RankedOverlap& other : ranks.gather_records(std::span<const RankedOverlap>(&worst, 1)))
    keep_worse(other, worst);
  return {worst.depth, worst.depth > tolerance, worst.pair};
}

}  // namespace talus
