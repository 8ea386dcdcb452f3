#include "runtime/step/places.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "kernels/detection/broad_phase.hpp"
#include "kernels/detection/wall_pairs.hpp"
#include "kernels/samples/detail/random_numbers.hpp"

namespace talus {

namespace {

/// Places that are looked at together: few messages for few seekers, little memory for many.
constexpr std::size_t tries_at_once = 4096;

struct Try {
  std::size_t seeker;
  Vec3 x;
};

/// The place of a seeker in a round, if its numbers give one.
Place place_of(const Region& region, const Seeker& seeker, const PlaceDraw& draw, std::int64_t round) {
  constexpr std::int64_t rounds = 1 << 29;
  const auto first = detail::place_draw + 2 * static_cast<std::uint32_t>((draw.round + round) % rounds);
  const auto a = detail::uniform_pair(draw.seed, seeker.number, first, draw.stream);
  const auto b = detail::uniform_pair(draw.seed, seeker.number, first + 1, draw.stream);
  return place_in(region, seeker.radius, {a[0], a[1], b[0]});
}

/// Bodies of this rank that reach into the region, and grains inserted already.
Spheres in_the_way(const Region& region, double largest, const StepState& state, const Spheres& taken) {
  Spheres spheres = taken;
  const Bounds bounds = bounds_of(region);
  // New centres lie in the box of the region; that of a disc is flat.
  for (std::size_t s = 0; s < state.bodies.size(); ++s)
    if (bounds.near(state.bodies.x[s], state.bodies.radius[s] + largest)) {
      spheres.x.push_back(state.bodies.x[s]);
      spheres.radius.push_back(state.bodies.radius[s]);
    }
  return spheres;
}

/// Pairs of tries that overlap, in order of the first, among those that nothing blocks: in a full region
/// these are few, and all tries about one hole overlap one another.
std::vector<std::pair<std::size_t, std::size_t>> rivals(std::span<const Try> tries,
                                                        std::span<const double> blocked,
                                                        std::span<const Seeker> seekers) {
  std::vector<std::size_t> place;
  std::vector<Vec3> x;
  std::vector<double> radius;
  for (std::size_t t = 0; t < tries.size(); ++t) {
    if (blocked[t] != 0) continue;
    place.push_back(t);
    x.push_back(tries[t].x);
    radius.push_back(seekers[tries[t].seeker].radius);
  }
  const CellGrid grid = build_cells(x, radius);
  std::vector<std::vector<GrainPair>> pairs(1);
  find_pairs(grid, 0, grid.cells.size(), pairs.front());
  std::vector<std::pair<std::size_t, std::size_t>> found;
  for (const GrainPair& pair : sort_pairs(pairs, x.size()))
    found.emplace_back(place[static_cast<std::size_t>(pair.first)],
                       place[static_cast<std::size_t>(pair.second)]);
  return found;
}

}  // namespace

FoundPlaces find_places(const Region& region, std::span<const Seeker> seekers, const PlaceDraw& draw,
                        const StepState& state, const Spheres& taken, const graph::Communicator& ranks) {
  std::vector<FoundPlace> found;
  double largest = 0;
  for (const Seeker& seeker : seekers) largest = std::max(largest, seeker.radius);
  Spheres spheres = in_the_way(region, largest, state, taken);
  std::vector<char> has_place(seekers.size(), 0);
  std::int64_t round = 0;
  while (round < draw.attempts && found.size() < seekers.size()) {
    const std::int64_t together = std::clamp<std::int64_t>(
        static_cast<std::int64_t>(tries_at_once / (seekers.size() - found.size())), 1, draw.attempts - round);
    std::vector<Try> tries;
    for (std::int64_t r = round; r < round + together; ++r)
      for (std::size_t k = 0; k < seekers.size(); ++k)
        if (const Place place = has_place[k] != 0 ? Place{} : place_of(region, seekers[k], draw, r);
            place.found)
          tries.push_back({k, place.x});
    round += together;
    const CellGrid grid = build_cells(spheres.x, spheres.radius);
    std::vector<double> blocked(tries.size(), 0);
    for (std::size_t t = 0; t < tries.size(); ++t) {
      const double radius = seekers[tries[t].seeker].radius;
      const bool taken_up =
          meets_any(grid, tries[t].x, radius) || std::ranges::any_of(state.walls, [&](const Wall& wall) {
            return meets_wall(wall, tries[t].x, radius);
          });
      blocked[t] = taken_up ? 1 : 0;
    }
    ranks.max(blocked);
    const auto pairs = rivals(tries, blocked, seekers);
    auto pair = pairs.begin();
    for (std::size_t t = 0; t < tries.size(); ++t) {
      const bool takes = blocked[t] == 0 && has_place[tries[t].seeker] == 0;
      for (; pair != pairs.end() && pair->first == t; ++pair)
        if (takes) blocked[pair->second] = 1;
      if (!takes) continue;
      has_place[tries[t].seeker] = 1;
      found.push_back({tries[t].seeker, tries[t].x});
      spheres.x.push_back(tries[t].x);
      spheres.radius.push_back(seekers[tries[t].seeker].radius);
    }
  }
  return {std::move(found), round};
}

}  // namespace talus
