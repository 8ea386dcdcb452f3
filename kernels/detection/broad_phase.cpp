#include "kernels/detection/broad_phase.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace talus {

namespace {

constexpr int x_shift = 38, y_shift = 19, level_shift = 57;
constexpr std::int32_t cells_an_axis = 1 << 19;
/// Cell of the origin. The cells of a sample around it differ in the low bits of their coordinates only, and
/// the sort skips digits that do not differ.
constexpr std::int32_t middle_cell = cells_an_axis / 2 + 512;
/// Cells are wider than the widest pair by more than the rounding of a place up to cells_an_axis, so that
/// a pair is never two cells apart.
constexpr double rounding_margin = 1 + 1e-9;

/// Key of the cell of a point in a level. Far coordinates are clamped to the outermost cells but one, which
/// keeps neighbours neighbours; every cell then has neighbours whose keys are near its own.
std::uint64_t key_of(const double* x, const Vec3& origin, std::size_t level, double size) {
  std::uint64_t key = std::uint64_t{level} << level_shift;
  constexpr int shift[3] = {x_shift, y_shift, 0};
  for (int axis = 0; axis < 3; ++axis) {
    const double at = (x[axis] - origin[axis]) / size + middle_cell;
    // Numbers are above 0, where cutting off digits rounds down. A NaN goes to 1.
    const double inside = std::min<double>(cells_an_axis - 2, std::max<double>(1, at));
    key |= static_cast<std::uint64_t>(static_cast<std::int32_t>(inside)) << shift[axis];
  }
  return key;
}

/// Where bodies are.
struct Spread {
  Vec3 middle;       ///< medians of the coordinates [m]
  double reach = 0;  ///< nearly all bodies are within this distance of it along every axis [m]
};

/// Spread of at most a thousand of the bodies. A few that fly far away must not push all others into one
/// clamped cell, so that the farthest twentieth at either end does not count.
Spread spread_of(std::span<const Vec3> x) {
  const std::size_t stride = (x.size() + 999) / 1000;
  std::vector<double> values;
  Spread result;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    values.clear();
    for (std::size_t k = 0; k < x.size(); k += stride) values.push_back(x[k][axis]);
    const auto smallest_but = [&](std::size_t place) {
      const auto at = values.begin() + static_cast<std::ptrdiff_t>(place);
      std::nth_element(values.begin(), at, values.end());
      return *at;
    };
    const std::size_t ends = values.size() / 20;
    const double middle = smallest_but(values.size() / 2);
    result.middle[axis] = middle;
    const double low = smallest_but(ends), high = smallest_but(values.size() - 1 - ends);
    result.reach = std::max({result.reach, middle - low, high - middle});
  }
  return result;
}

/// Factor by which cells of `size` [m] must be widened to give nearly all bodies cells that are not clamped:
/// far cells are clamped into one, in which a line of grains would be compared pair by pair.
double widening(const Spread& spread, double size) {
  constexpr double margin = 1.25;  // a twentieth was left out at either end
  constexpr double cells = cells_an_axis - 2 - middle_cell;
  const double factor = margin * spread.reach / (cells * size);
  return factor > 1 && std::isfinite(factor) ? factor : 1;
}

struct Entry {
  std::uint64_t key;
  Slot slot;
};

/// Sorts by key, and keeps the order of equal keys: a radix sort that skips digits which do not vary.
void sort_by_key(std::vector<Entry>& entries) {
  constexpr int digit = 11;
  constexpr std::size_t values = std::size_t{1} << digit;
  std::uint64_t varies = 0;
  for (const Entry& entry : entries) varies |= entry.key ^ entries[0].key;
  std::vector<Entry> sorted(entries.size());
  for (int shift = 0; shift < 64; shift += digit) {
    if ((varies >> shift) % values == 0) continue;
    std::array<std::size_t, values + 1> next{};
    for (const Entry& entry : entries) ++next[(entry.key >> shift) % values + 1];
    std::partial_sum(next.begin(), next.end(), next.begin());
    for (const Entry& entry : entries) sorted[next[(entry.key >> shift) % values]++] = entry;
    entries.swap(sorted);
  }
}

/// Bodies that stand side by side in a grid.
struct Others {
  std::span<const CellGrid::Member> members;
  std::span<const Slot> slots;
};
/// Bodies [begin, end) of a grid.
Others others_of(const CellGrid& grid, std::size_t begin, std::size_t end) {
  return {std::span(grid.members).subspan(begin, end - begin),
          std::span(grid.slots).subspan(begin, end - begin)};
}

/// Appends pairs without a branch: each pair tested is written, and the next one overwrites it unless it was
/// near enough. The length of the list is known at the end only.
class PairList {
 public:
  explicit PairList(std::vector<GrainPair>& pairs) : pairs_(pairs), size_(pairs.size()) {}
  ~PairList() { pairs_.resize(size_); }
  PairList(const PairList&) = delete;
  PairList& operator=(const PairList&) = delete;

  /// Appends the pairs of body a of `grid` with those `others` that are near enough.
  void add(const CellGrid& grid, std::size_t a, const Others& others) {
    const std::size_t count = others.members.size();
    if (size_ + count > pairs_.size()) pairs_.resize(2 * (size_ + count));
    const CellGrid::Member one = grid.members[a];
    const Slot slot = grid.slots[a];
    GrainPair* next = pairs_.data() + size_;
    for (std::size_t b = 0; b < count; ++b) {
      const CellGrid::Member& other = others.members[b];
      const Vec3 d = Vec3(one.x[0], one.x[1], one.x[2]) - Vec3(other.x[0], other.x[1], other.x[2]);
      const double distance = one.reach + other.reach;
      *next = {std::min(slot, others.slots[b]), std::max(slot, others.slots[b])};
      next += d[0] * d[0] + d[1] * d[1] + d[2] * d[2] < distance * distance ? 1 : 0;
    }
    size_ = static_cast<std::size_t>(next - pairs_.data());
  }

 private:
  std::vector<GrainPair>& pairs_;
  std::size_t size_;
};

/// Bodies [begin, end) of a grid, all those of three cells in a row.
struct Row {
  std::size_t begin = 0, end = 0;
};
/// The bodies of the cells whose keys are within 1 of `key`. `cell` may be any cell up to the first of these,
/// and is moved on to the first.
Row row_at(const CellGrid& grid, std::uint64_t key, std::size_t& cell) {
  while (cell < grid.cells.size() && grid.cells[cell].key + 1 < key) ++cell;
  std::size_t last = cell;
  while (last < grid.cells.size() && grid.cells[last].key <= key + 1) ++last;
  if (last == cell) return {};
  return {static_cast<std::size_t>(grid.cells[cell].begin),
          static_cast<std::size_t>(grid.cells[last - 1].end)};
}

std::size_t first_cell(const CellGrid& grid, std::uint64_t key) {
  const auto at = std::lower_bound(grid.cells.begin(), grid.cells.end(), key,
                                   [](const CellGrid::Cell& cell, std::uint64_t k) { return cell.key < k; });
  return static_cast<std::size_t>(at - grid.cells.begin());
}

constexpr std::uint64_t one_x = std::uint64_t{1} << x_shift, one_y = std::uint64_t{1} << y_shift;
/// Of the 9 rows of 3 cells around a cell, the 4 behind its own.
constexpr std::array<std::uint64_t, 4> rows_behind = {one_y, one_x - one_y, one_x, one_x + one_y};
constexpr std::array<std::uint64_t, 9> rows_around = {
    0 - one_x - one_y, 0 - one_x, one_y - one_x, 0 - one_y, 0, one_y, one_x - one_y, one_x, one_x + one_y};

/// Pairs of the bodies of cells [begin, end) that stand in finer levels with those of `level`. These bodies
/// are sorted by the cell of `level` in which they lie, so that its neighbours are found once, by going on
/// from those of the last cell.
void find_larger(const CellGrid& grid, std::size_t begin, std::size_t end, std::size_t level,
                 PairList& list) {
  std::vector<Entry> below;
  for (std::size_t c = begin; c < end && grid.cells[c].key >> level_shift < level; ++c)
    for (std::int32_t a = grid.cells[c].begin; a < grid.cells[c].end; ++a)
      below.push_back(
          {key_of(grid.members[static_cast<std::size_t>(a)].x, grid.origin, level, grid.cell_size[level]),
           a});
  if (below.empty()) return;
  sort_by_key(below);
  std::array<std::size_t, rows_around.size()> cell;
  for (std::size_t r = 0; r < cell.size(); ++r) cell[r] = first_cell(grid, below[0].key + rows_around[r] - 1);
  std::vector<CellGrid::Member> members;
  std::vector<Slot> slots;
  for (std::size_t k = 0; k < below.size(); ++k) {
    if (k == 0 || below[k].key != below[k - 1].key) {
      members.clear();
      slots.clear();
      for (std::size_t r = 0; r < cell.size(); ++r) {
        const Row row = row_at(grid, below[k].key + rows_around[r], cell[r]);
        const Others others = others_of(grid, row.begin, row.end);
        members.insert(members.end(), others.members.begin(), others.members.end());
        slots.insert(slots.end(), others.slots.begin(), others.slots.end());
      }
    }
    if (!slots.empty()) list.add(grid, static_cast<std::size_t>(below[k].slot), {members, slots});
  }
}

}  // namespace

CellGrid build_cells(std::span<const Vec3> x, std::span<const double> reach) {
  CellGrid grid;
  const std::size_t n = x.size();
  if (n == 0) return grid;
  double smallest = reach[0], largest = reach[0];
  const Spread spread = spread_of(x);
  grid.origin = spread.middle;
  for (double r : reach) {
    smallest = std::min(smallest, r);
    largest = std::max(largest, r);
  }
  // The coarsest level is fitted to the largest body; even samples then have one level and cells that are not
  // too large.
  // The bound is applied to a floating-point number: a reach may be infinite in a step that ends as a
  // runaway.
  const int levels = 1 + static_cast<int>(std::min(31.0, std::floor(std::log2(largest / smallest))));
  grid.cell_size.resize(static_cast<std::size_t>(levels));
  for (int level = 0; level < levels; ++level)
    grid.cell_size[static_cast<std::size_t>(level)] =
        2 * largest * std::exp2(level - levels + 1) * rounding_margin;
  if (const double factor = widening(spread, grid.cell_size[0]); factor > 1)
    for (double& size : grid.cell_size) size *= factor;

  std::vector<Entry> entries(n);
  for (std::size_t k = 0; k < n; ++k) {
    std::size_t level = 0;
    while (grid.cell_size[level] < 2 * reach[k] * rounding_margin) ++level;
    entries[k] = {key_of(x[k].data(), grid.origin, level, grid.cell_size[level]), static_cast<Slot>(k)};
  }
  sort_by_key(entries);

  grid.slots.resize(n);
  grid.members.resize(n);
  for (std::size_t k = 0; k < n; ++k) {
    const Slot slot = entries[k].slot;
    const auto s = static_cast<std::size_t>(slot);
    grid.slots[k] = slot;
    grid.members[k] = {{x[s][0], x[s][1], x[s][2]}, reach[s]};
    const auto at = static_cast<std::int32_t>(k);
    if (k == 0 || entries[k].key != entries[k - 1].key) grid.cells.push_back({entries[k].key, at, at});
    grid.cells.back().end = at + 1;
  }
  return grid;
}

void find_pairs(const CellGrid& grid, std::size_t begin, std::size_t end, std::vector<GrainPair>& pairs) {
  if (begin == end) return;
  PairList list(pairs);
  // Keys ascend, and so do those of the rows: the search for each row goes on from where it was.
  std::array<std::size_t, rows_behind.size()> cell;
  for (std::size_t r = 0; r < cell.size(); ++r)
    cell[r] = first_cell(grid, grid.cells[begin].key + rows_behind[r] - 1);
  for (std::size_t c = begin; c < end; ++c) {
    const std::uint64_t key = grid.cells[c].key;
    const auto from = static_cast<std::size_t>(grid.cells[c].begin),
               to = static_cast<std::size_t>(grid.cells[c].end);
    const bool next = c + 1 < grid.cells.size() && grid.cells[c + 1].key == key + 1;
    const std::size_t own = next ? static_cast<std::size_t>(grid.cells[c + 1].end) : to;
    for (std::size_t a = from; a < to; ++a) list.add(grid, a, others_of(grid, a + 1, own));
    for (std::size_t r = 0; r < cell.size(); ++r) {
      const Row row = row_at(grid, key + rows_behind[r], cell[r]);
      const Others others = others_of(grid, row.begin, row.end);
      for (std::size_t a = from; a < to && row.begin < row.end; ++a) list.add(grid, a, others);
    }
  }
  for (std::size_t level = 1; level < grid.cell_size.size(); ++level)
    find_larger(grid, begin, end, level, list);
}

bool meets_any(const CellGrid& grid, const Vec3& x, double reach) {
  for (std::size_t level = 0; level < grid.cell_size.size(); ++level) {
    const double size = grid.cell_size[level];
    // Bodies of a level reach half a cell at most.
    const auto cells =
        static_cast<std::int64_t>(std::min<double>(cells_an_axis, (reach + 0.5 * size) / size)) + 1;
    const std::uint64_t centre = key_of(x.data(), grid.origin, level, size);
    std::array<std::int64_t, 3> at{}, low{}, high{};
    constexpr std::array<int, 3> shift = {x_shift, y_shift, 0};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      at[axis] = static_cast<std::int64_t>(centre >> shift[axis] & (cells_an_axis - 1));
      low[axis] = std::max<std::int64_t>(0, at[axis] - cells);
      high[axis] = std::min<std::int64_t>(cells_an_axis - 1, at[axis] + cells);
    }
    const std::uint64_t base = std::uint64_t{level} << level_shift;
    for (std::int64_t i = low[0]; i <= high[0]; ++i)
      for (std::int64_t j = low[1]; j <= high[1]; ++j) {
        const std::uint64_t row =
            base | static_cast<std::uint64_t>(i) << x_shift | static_cast<std::uint64_t>(j) << y_shift;
        const std::uint64_t end = row | static_cast<std::uint64_t>(high[2]);
        for (std::size_t c = first_cell(grid, row | static_cast<std::uint64_t>(low[2]));
             c < grid.cells.size() && grid.cells[c].key <= end; ++c)
          for (auto k = static_cast<std::size_t>(grid.cells[c].begin);
               k < static_cast<std::size_t>(grid.cells[c].end); ++k) {
            const CellGrid::Member& other = grid.members[k];
            const double distance = reach + other.reach;
            if ((x - Vec3(other.x)).squaredNorm() < distance * distance) return true;
          }
      }
  }
  return false;
}

std::vector<GrainPair> sort_pairs(std::span<const std::vector<GrainPair>> parts, std::size_t bodies) {
  std::vector<std::int32_t> offset(bodies + 1, 0);
  for (const auto& part : parts)
    for (const GrainPair& pair : part) ++offset[static_cast<std::size_t>(pair.first) + 1];
  for (std::size_t k = 0; k < bodies; ++k) offset[k + 1] += offset[k];
  std::vector<GrainPair> sorted(static_cast<std::size_t>(offset[bodies]));
  std::vector<std::int32_t> next(offset.begin(), offset.end() - 1);
  for (const auto& part : parts)
    for (const GrainPair& pair : part)
      sorted[static_cast<std::size_t>(next[static_cast<std::size_t>(pair.first)]++)] = pair;
  for (std::size_t k = 0; k < bodies; ++k)
    std::sort(sorted.begin() + offset[k], sorted.begin() + offset[k + 1],
              [](const GrainPair& a, const GrainPair& b) { return a.second < b.second; });
  return sorted;
}

}  // namespace talus
