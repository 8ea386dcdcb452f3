/// Subdomains as stretches of equal weight of a Hilbert curve through a grid of cells: compact like those of
/// a graph partitioner, for the price of a sort. One that follows another on the curve is its neighbour, so
/// that blocks of consecutive subdomains on a rank are compact too.

#include <algorithm>
#include <bit>
#include <numeric>

#include "partition/detail/cell_graph.hpp"
#include "partition/partitioners.hpp"

namespace talus {
namespace {

using Place = std::array<std::uint32_t, 3>;

/// Number of a place, of `bits` bits an axis, on the Hilbert curve through the cube. Skilling (2004),
/// "Programming the Hilbert curve", AIP Conference Proceedings 707: 381-387.
std::uint64_t number_on_curve(Place x, int bits) {
  const std::uint32_t top = std::uint32_t{1} << bits >> 1;
  for (std::uint32_t q = top; q > 1; q >>= 1)
    for (std::uint32_t& coordinate : x) {
      const std::uint32_t low = q - 1, swapped = (x[0] ^ coordinate) & low;
      if ((coordinate & q) != 0) {
        x[0] ^= low;
      } else {
        x[0] ^= swapped;
        coordinate ^= swapped;
      }
    }
  x[1] ^= x[0];
  x[2] ^= x[1];
  std::uint32_t flips = 0;
  for (std::uint32_t q = top; q > 1; q >>= 1)
    if ((x[2] & q) != 0) flips ^= q - 1;
  std::uint64_t number = 0;
  for (int bit = bits - 1; bit >= 0; --bit)
    for (const std::uint32_t coordinate : x) number = number << 1 | ((coordinate ^ flips) >> bit & 1);
  return number;
}

/// Cells in the order of the curve through the smallest cube of 2^k cells an edge that holds the grid.
std::vector<std::size_t> along_curve(const CellTable& table) {
  const auto longest = static_cast<std::uint32_t>(*std::ranges::max_element(table.cells));
  const auto bits = static_cast<int>(std::bit_width(longest - 1));
  std::vector<std::uint64_t> number;
  for (std::int32_t z = 0; z < table.cells[2]; ++z)
    for (std::int32_t y = 0; y < table.cells[1]; ++y)
      for (std::int32_t x = 0; x < table.cells[0]; ++x)
        number.push_back(number_on_curve(
            {static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y), static_cast<std::uint32_t>(z)},
            bits));
  std::vector<std::size_t> order(number.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, {}, [&](std::size_t cell) { return number[cell]; });
  return order;
}

void cut_hilbert(const Cutting& cutting, Partition& partition) {
  const std::int64_t n = partition.subdomains;
  std::vector<std::int64_t> weight;
  CellTable& table = partition.table;
  table = detail::choose_cells(cutting.points, partition.frame, detail::cells_per_subdomain * n,
                               cutting.reduction, weight);
  const std::int64_t sum = std::reduce(weight.begin(), weight.end());
  table.subdomain.assign(weight.size(), 0);
  // A cell belongs where its middle lies on the curve, measured in weight. Cells without weight go with those
  // before them.
  std::int64_t before = 0;
  for (const std::size_t cell : along_curve(table)) {
    const std::int64_t middle = 2 * before + weight[cell];
    if (sum > 0) table.subdomain[cell] = static_cast<std::int32_t>(std::min(n - 1, middle * n / (2 * sum)));
    before += weight[cell];
  }
}

}  // namespace

const Partitioner hilbert_partitioner{cut_hilbert};

}  // namespace talus
