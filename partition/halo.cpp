#include "partition/halo.hpp"

#include <algorithm>

namespace talus {

namespace {

using Corner = std::array<std::uint32_t, 3>;

void collect(const CutTree& tree, std::int32_t node, const Corner& low, const Corner& high,
             std::vector<SubdomainId>& found) {
  if (node < 0) {
    found.emplace_back(-1 - node);
    return;
  }
  const CutTree::Cut& cut = tree.cuts[static_cast<std::size_t>(node)];
  // The two other coordinates only tell points of the very plane of the cut apart.
  const auto plane = static_cast<std::uint32_t>(cut.key >> (2 * IntegerFrame::bits));
  const auto axis = static_cast<std::size_t>(cut.axis);
  if (low[axis] <= plane) collect(tree, cut.below, low, high, found);
  if (high[axis] >= plane) collect(tree, cut.above, low, high, found);
}

void collect(const CellTable& table, const Corner& low, const Corner& high, std::vector<SubdomainId>& found) {
  const auto cell = [&](std::size_t axis, std::uint32_t q) {
    return static_cast<std::size_t>(std::uint64_t{q} * static_cast<std::uint64_t>(table.cells[axis]) >>
                                    IntegerFrame::bits);
  };
  const auto nx = static_cast<std::size_t>(table.cells[0]), ny = static_cast<std::size_t>(table.cells[1]);
  for (std::size_t z = cell(2, low[2]); z <= cell(2, high[2]); ++z)
    for (std::size_t y = cell(1, low[1]); y <= cell(1, high[1]); ++y)
      for (std::size_t x = cell(0, low[0]); x <= cell(0, high[0]); ++x)
        found.emplace_back(table.subdomain[x + nx * (y + ny * z)]);
}

}  // namespace

std::vector<SubdomainId> subdomains_within(const Partition& partition, const Vec3& point, double distance) {
  if (partition.subdomains == 1) return {SubdomainId(0)};
  const Vec3 reach = Vec3::Constant(distance);
  const Corner low = partition.frame.coordinates(point - reach),
               high = partition.frame.coordinates(point + reach);
  std::vector<SubdomainId> found;
  if (partition.by_table())
    collect(partition.table, low, high, found);
  else
    collect(partition.tree, 0, low, high, found);
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
  return found;
}

}  // namespace talus
