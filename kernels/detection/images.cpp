#include "kernels/detection/images.hpp"

#include <algorithm>

namespace talus {

ImagedBodies with_images(const Domain& domain, std::span<const Vec3> x, std::span<const double> reach) {
  ImagedBodies bodies{{x.begin(), x.end()}, {reach.begin(), reach.end()}, {}};
  const double largest = x.empty() ? 0 : *std::ranges::max_element(reach);
  for (std::size_t s = 0; s < x.size(); ++s)
    domain.each_image(x[s], reach[s] + largest, [&](const Vec3& k, const Vec3& image) {
      const double first = k[2] != 0 ? k[2] : k[1] != 0 ? k[1] : k[0];
      if (!(first > 0)) return;
      bodies.x.push_back(image);
      bodies.reach.push_back(reach[s]);
      bodies.original.push_back(static_cast<Slot>(s));
    });
  return bodies;
}

void fold_images(std::size_t bodies, std::span<const Slot> original, std::vector<GrainPair>& pairs) {
  const auto n = static_cast<Slot>(bodies);
  std::erase_if(pairs, [&](GrainPair& pair) {
    if (pair.second < n) return false;
    if (pair.first >= n) return true;
    const Slot other = original[static_cast<std::size_t>(pair.second - n)];
    const Slot one = pair.first;
    pair = {std::min(one, other), std::max(one, other)};
    return one == other;
  });
}

void drop_repeated(std::vector<GrainPair>& pairs) {
  // Not std::ranges::unique: clang 14 does not take libstdc++'s subrange.
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
}

std::vector<GrainPair> near_pairs(const Domain& domain, std::span<const Vec3> x,
                                  std::span<const double> reach) {
  std::vector<std::vector<GrainPair>> pairs(1);
  if (!domain.repeats) {
    const CellGrid grid = build_cells(x, reach);
    find_pairs(grid, 0, grid.cells.size(), pairs[0]);
    return pairs[0];
  }
  std::vector<Vec3> inside;
  for (const Vec3& place : x) inside.push_back(domain.wrap(place));
  const ImagedBodies imaged = with_images(domain, inside, reach);
  const CellGrid grid = build_cells(imaged.x, imaged.reach);
  find_pairs(grid, 0, grid.cells.size(), pairs[0]);
  fold_images(x.size(), imaged.original, pairs[0]);
  std::vector<GrainPair> sorted = sort_pairs(pairs, x.size());
  drop_repeated(sorted);
  return sorted;
}

}  // namespace talus
