#include "kernels/detection/wall_pairs.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

namespace talus {

namespace {

/// Spheres with the margin of one wall.
struct Reaching {
  std::span<const Vec3> x;
  std::span<const double> reach;
  double margin;
  double of(std::size_t s) const { return reach[s] + margin; }
};

void find_at_plane(const Reaching& bodies, const Wall& wall, std::int32_t number, const Domain& domain,
                   std::vector<WallPair>& pairs) {
  for (std::size_t s = 0; s < bodies.x.size(); ++s)
    if (wall.normal.dot(domain.separation(bodies.x[s], wall.point)) < bodies.of(s))
      pairs.push_back({number, static_cast<Slot>(s)});
}

void find_at_surface(const Reaching& bodies, const Wall& wall, std::int32_t number,
                     std::vector<WallPair>& pairs) {
  const Surface& surface = *wall.surface();
  const Bounds bounds = surface.bounds();
  const std::size_t from = pairs.size();
  std::vector<std::int32_t> features;
  for (std::size_t s = 0; s < bodies.x.size(); ++s) {
    const Vec3 x = wall.pose.back(bodies.x[s]);
    if (!bounds.near(x, bodies.of(s))) continue;
    features.clear();
    surface.near(x, bodies.of(s), features);
    for (const std::int32_t feature : features) pairs.push_back({number, static_cast<Slot>(s), feature});
  }
  const std::vector<WallPair> found(pairs.begin() + static_cast<std::ptrdiff_t>(from), pairs.end());
  std::ranges::transform(layered_order(found), pairs.begin() + static_cast<std::ptrdiff_t>(from),
                         [&](std::size_t k) { return found[k]; });
}

}  // namespace

std::vector<std::size_t> layered_order(std::span<const WallPair> pairs) {
  std::vector<std::size_t> order(pairs.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, [&](std::size_t a, std::size_t b) { return before(pairs[a], pairs[b]); });
  std::vector<std::size_t> layer(pairs.size(), 0);
  for (std::size_t k = 1; k < order.size(); ++k) {
    const WallPair &one = pairs[order[k - 1]], &next = pairs[order[k]];
    if (one.wall == next.wall && one.body == next.body) layer[order[k]] = layer[order[k - 1]] + 1;
  }
  std::ranges::stable_sort(order, {}, [&](std::size_t k) { return std::pair{pairs[k].wall, layer[k]}; });
  return order;
}

std::vector<WallPair> find_wall_pairs(std::span<const Vec3> x, std::span<const double> reach,
                                      std::span<const Wall> walls, std::span<const double> margin,
                                      const Domain& domain) {
  std::vector<WallPair> pairs;
  for (std::size_t w = 0; w < walls.size(); ++w) {
    const auto number = static_cast<std::int32_t>(w);
    if (walls[w].absent) continue;
    if (walls[w].surface() == nullptr)
      find_at_plane({x, reach, margin[w]}, walls[w], number, domain, pairs);
    else
      find_at_surface({x, reach, margin[w]}, walls[w], number, pairs);
  }
  return pairs;
}

}  // namespace talus
