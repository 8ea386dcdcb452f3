#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <tuple>

#include "kernels/samples/detail/radius_slices.hpp"
#include "kernels/samples/resting_site.hpp"
#include "kernels/samples/sample.hpp"

namespace talus {

namespace {

// The search. A site is a triple of supports; for a range of radii a grain can rest on it. All sites are born
// when their youngest support is placed, and only shrink as later grains block them. The radii are halved
// again and again (radius_slices.hpp), and each slice has a heap of sites, keyed by their height for the
// smallest radius of the slice. Height grows at least as fast as radius (resting_site.hpp), so that the key
// and what the radius has beyond that of the slice bound from below what a grain can get there. A site begins
// in the slice of all radii. To place a grain, sites leave the heaps of the slices that hold its radius until
// the bound exceeds the best height found: exact for the grain's own radius. A site whose bound was too low
// goes on to the halves of its slice: only those that come near to being the lowest are ever sorted finely,
// and most are buried before. A new grain does not update the sites that it blocks: each site is checked
// against its neighbours when it is examined.

// Supports that are not grains; the lower number counts as the older.
enum Plane : std::int32_t { floor_plane = -1, x_high = -2, x_low = -3, y_high = -4, y_low = -5 };

struct LyingGrain {
  Vec3 x;
  double radius;
};

struct Site {
  std::array<std::int32_t, 3> support;  ///< descending: the youngest grain first, then planes
  std::int8_t side;                     ///< which of two places, for sites on the floor
  std::int32_t uses = 0;                ///< entries in heaps; the slot is free again at 0
  std::int32_t version = 0;             ///< counts the changes of its range
  RadiusRange range;
};

/// Among equal heights the older supports win.
auto seniority(const Site& site) {
  return std::make_tuple(site.support, site.side);
}

struct Entry {
  double bound;  ///< a grain of the class rests here at least so high, and what its radius is larger [m]
  std::int32_t site;
  std::int32_t version = 0;  ///< of the site, for which the bound was found
};
struct Higher {
  bool operator()(const Entry& a, const Entry& b) const {
    return a.bound != b.bound ? a.bound > b.bound : a.site > b.site;
  }
};

/// Grains by cubic cells; layers are added as the sample grows.
class Cells {
 public:
  Cells(double side, double length_x, double length_y)
      : side_(side),
        nx_(static_cast<std::int64_t>(length_x / side) + 1),
        ny_(static_cast<std::int64_t>(length_y / side) + 1) {}

  void add(std::int32_t grain, const Vec3& x) {
    const std::int64_t layer = index(x[2]);
    if (static_cast<std::size_t>((layer + 1) * nx_ * ny_) > head_.size())
      head_.resize(static_cast<std::size_t>((layer + 1) * nx_ * ny_), none);
    std::int32_t& head = head_[cell(index(x[0]), index(x[1]), layer)];
    next_.push_back(head);
    head = grain;
  }

  /// visit(grain) for every grain whose centre may lie within `reach` of x, until it returns false.
  template <class Visit>
  void visit_near(const Vec3& x, double reach, const Visit& visit) const {
    const std::int64_t layers = static_cast<std::int64_t>(head_.size()) / (nx_ * ny_);
    const auto low = [&](int axis) { return std::max<std::int64_t>(index(x[axis] - reach), 0); };
    const auto high = [&](int axis, std::int64_t n) { return std::min(index(x[axis] + reach), n - 1); };
    for (std::int64_t k = low(2); k <= high(2, layers); ++k)
      for (std::int64_t j = low(1); j <= high(1, ny_); ++j)
        for (std::int64_t i = low(0); i <= high(0, nx_); ++i)
          for (std::int32_t g = head_[cell(i, j, k)]; g != none; g = next_[static_cast<std::size_t>(g)])
            if (!visit(g)) return;
  }

 private:
  static constexpr std::int32_t none = -1;
  std::int64_t index(double x) const { return static_cast<std::int64_t>(std::floor(x / side_)); }
  std::size_t cell(std::int64_t i, std::int64_t j, std::int64_t k) const {
    return static_cast<std::size_t>((k * ny_ + j) * nx_ + i);
  }

  double side_;
  std::int64_t nx_, ny_;
  std::vector<std::int32_t> head_, next_;
};

class Deposition {
  using Slices = detail::RadiusSlices;

 public:
  Deposition(double smallest, double largest, double length_x, double length_y, std::size_t n)
      : smallest_(smallest),
        largest_(largest),
        lx_(length_x),
        ly_(length_y),
        cells_(2 * largest, length_x, length_y),
        slices_(smallest, largest),
        heaps_(Slices::end) {
    grains_.reserve(n);
    for (const std::int32_t x : {x_low, x_high})
      for (const std::int32_t y : {y_low, y_high}) add_site({floor_plane, x, y}, 0, {smallest, largest});
  }

  /// The centre of the next grain.
  Vec3 place(double radius) {
    const std::array<std::size_t, Slices::levels> around = slices_.around(radius);
    Vec3 best = Vec3::Constant(std::numeric_limits<double>::infinity());
    std::int32_t best_site = -1;
    aside_.clear();
    // Less what rounding may hide: sites of equal height must all be examined.
    const auto rise = [&](std::size_t slice) { return radius - slices_.low(slice) - 1e-9 * largest_; };
    for (;;) {
      std::size_t slice = 0;
      double least = std::numeric_limits<double>::infinity();
      for (const std::size_t s : around) {
        if (heaps_[s].empty() || heaps_[s].front().bound + rise(s) >= least) continue;
        least = heaps_[s].front().bound + rise(s);
        slice = s;
      }
      if (slice == 0 || least > best[2]) break;
      Entry entry = pop(slice);
      const std::int32_t id = entry.site;
      if (entry.version != site(id).version && !renew(entry, slice)) {
        release(id);
        continue;
      }
      if (entry.bound + rise(slice) <= best[2] && radius >= site(id).range.low &&
          radius <= site(id).range.high) {
        const Vec3 x = centre(site(id), radius);
        if (!shrink_if_blocked(id, x, radius) &&
            (best_site < 0 || x[2] < best[2] ||
             (x[2] == best[2] && seniority(site(id)) < seniority(site(best_site))))) {
          best = x;
          best_site = id;
          aside_.push_back({entry, slice});
          continue;
        }
      }
      put_aside(entry, slice);
    }
    for (const auto& [entry, slice] : aside_) push(slice, entry);
    if (best_site < 0)
      throw std::invalid_argument("deposit: no place with three supports for a grain of radius " +
                                  std::to_string(radius) + " m in a base of " + std::to_string(lx_) +
                                  " m x " + std::to_string(ly_) + " m; widen the base");
    add_grain(best, radius);
    return best;
  }

 private:
  Site& site(std::int32_t id) { return sites_[static_cast<std::size_t>(id)]; }
  const LyingGrain& grain(std::int32_t g) const { return grains_[static_cast<std::size_t>(g)]; }

  /// Obstacle `s`, grain or plane, seen from `base`.
  Obstacle obstacle(std::int32_t s, const LyingGrain& base) const {
    switch (s) {
      case floor_plane:
        return wall_obstacle(Vec3::UnitZ(), base.x[2]);
      case x_low:
        return wall_obstacle(Vec3::UnitX(), base.x[0]);
      case x_high:
        return wall_obstacle(-Vec3::UnitX(), lx_ - base.x[0]);
      case y_low:
        return wall_obstacle(Vec3::UnitY(), base.x[1]);
      case y_high:
        return wall_obstacle(-Vec3::UnitY(), ly_ - base.x[1]);
      default:
        return grain_obstacle(grain(s).x - base.x, grain(s).radius, base.radius);
    }
  }

  SiteCurve curve_of(const Site& s) const {
    const LyingGrain& base = grain(s.support[0]);
    SiteCurve curve;
    site_curve(base.radius, obstacle(s.support[1], base), obstacle(s.support[2], base), s.side, curve);
    return curve;
  }

  Vec3 centre(const Site& s, double radius) const {
    if (s.support[0] >= 0) {
      Vec3 x = grain(s.support[0]).x + curve_of(s).at(radius);
      // Exact where the support is a plane: heights on the floor compare equal.
      for (std::size_t k : {1, 2}) snap(s.support[k], radius, x);
      return x;
    }
    Vec3 corner;
    for (const std::int32_t plane : s.support) snap(plane, radius, corner);
    return corner;
  }

  void snap(std::int32_t plane, double radius, Vec3& x) const {
    if (plane == floor_plane) x[2] = radius;
    if (plane == x_low) x[0] = radius;
    if (plane == x_high) x[0] = lx_ - radius;
    if (plane == y_low) x[1] = radius;
    if (plane == y_high) x[1] = ly_ - radius;
  }

  bool meets(const RadiusRange& range, std::size_t slice) const {
    return range.low <= range.high && range.high >= slices_.low(slice) && range.low < slices_.high(slice);
  }

  /// What a site's entry in the heap of a slice that its range meets is sorted by.
  double bound_in(const Site& s, std::size_t slice) const {
    const double from = std::max(s.range.low, slices_.low(slice));
    return centre(s, from)[2] - (from - slices_.low(slice));
  }

  /// Brings an entry of the slice up to date with its site. False if no grain of the slice will ever rest
  /// there.
  bool renew(Entry& entry, std::size_t slice) {
    if (!meets(site(entry.site).range, slice)) return false;
    entry.bound = std::max(entry.bound, bound_in(site(entry.site), slice));
    entry.version = site(entry.site).version;
    return true;
  }

  /// Gives the slice an entry of the site if its range meets it.
  void enter(std::int32_t id, std::size_t slice) {
    if (!meets(site(id).range, slice)) return;
    push(slice, {bound_in(site(id), slice), id, site(id).version});
    ++site(id).uses;
  }

  /// Behind an examination: from a leaf an entry is kept from coming up again for this grain, others are
  /// handed to the halves of their slice.
  void put_aside(const Entry& entry, std::size_t slice) {
    if (Slices::is_leaf(slice)) {
      aside_.push_back({entry, slice});
      return;
    }
    enter(entry.site, 2 * slice);
    enter(entry.site, 2 * slice + 1);
    release(entry.site);
  }

  /// Whether a grain overlaps others at x; if so, the radii that the blocking grain forbids leave the site's
  /// range.
  bool shrink_if_blocked(std::int32_t id, const Vec3& x, double radius) {
    std::int32_t blocker = -1;
    cells_.visit_near(x, radius + largest_, [&](std::int32_t g) {
      const double distance = grain(g).radius + radius;
      if ((grain(g).x - x).squaredNorm() < distance * distance - slack()) blocker = g;
      return blocker < 0;
    });
    if (blocker < 0) return false;
    if (site(id).support[0] < 0) return true;  // the four corners stay as they are
    const LyingGrain& base = grain(site(id).support[0]);
    ranges_.assign(1, site(id).range);
    keep_clear(curve_of(site(id)), obstacle(blocker, base), 0, ranges_);
    // A grain in the middle of the range leaves two parts; the second becomes a site of its own.
    site(id).range = ranges_.empty() ? RadiusRange{1, 0} : ranges_[0];
    ++site(id).version;
    for (std::size_t k = 1; k < ranges_.size(); ++k) {
      const Site whole = site(id);
      add_site(whole.support, whole.side, ranges_[k]);
    }
    return true;
  }

  void add_grain(const Vec3& x, double radius) {
    const auto g = static_cast<std::int32_t>(grains_.size());
    grains_.push_back({x, radius});
    // Whatever can touch or block a grain that touches this one.
    near_.clear();
    cells_.visit_near(x, radius + 3 * largest_, [&](std::int32_t other) {
      const double gap = (grain(other).x - x).norm() - grain(other).radius - radius;
      if (gap < 2 * largest_) near_.push_back({gap, other, {}});
      return true;
    });
    const std::array<double, 5> to_plane{x[2], lx_ - x[0], x[0], ly_ - x[1], x[1]};
    for (std::int32_t plane = floor_plane; plane >= y_low; --plane) {
      const double gap = to_plane[static_cast<std::size_t>(-1 - plane)] - radius;
      if (gap < 2 * largest_) near_.push_back({gap, plane, {}});
    }
    // The nearest obstacle blocks most often: tested first, it rejects most triples at once.
    std::sort(near_.begin(), near_.end(), [](const Near& a, const Near& b) {
      return std::tie(a.gap, a.index) < std::tie(b.gap, b.index);
    });
    for (Near& n : near_) n.obstacle = obstacle(n.index, grains_.back());
    cells_.add(g, x);
    for (const Near& first : near_)
      for (const Near& second : near_)
        if (first.index > second.index) add_sites_on(g, first, second);
  }

  struct Near {
    double gap;
    std::int32_t index;
    Obstacle obstacle;
  };

  /// The sites on grain g and two obstacles near it, in descending order.
  void add_sites_on(std::int32_t g, const Near& first, const Near& second) {
    if (second.index >= 0) {
      const double reach = grain(first.index).radius + grain(second.index).radius + 2 * largest_;
      if ((first.obstacle.d - second.obstacle.d).squaredNorm() > reach * reach) return;
    }
    const bool on_floor = first.index == floor_plane || second.index == floor_plane;
    for (const int side : {1, -1}) {
      if (side < 0 && !on_floor) return;
      SiteCurve curve;
      if (!site_curve(grains_.back().radius, first.obstacle, second.obstacle, side, curve)) return;
      ranges_.assign(1, {smallest_, largest_});
      bound_root(ranges_[0], curve);
      keep_real(curve, ranges_);
      if (!on_floor && !ranges_.empty()) keep_stable(curve, first.obstacle, second.obstacle, 1e-12, ranges_);
      for (const Near& n : near_) {
        if (ranges_.empty()) break;
        if (n.index != first.index && n.index != second.index)
          keep_clear(curve, n.obstacle, 0.5 * slack(), ranges_);
      }
      for (const RadiusRange& range : ranges_)
        add_site({g, first.index, second.index}, static_cast<std::int8_t>(side), range);
    }
  }

  void add_site(const std::array<std::int32_t, 3>& support, std::int8_t side, const RadiusRange& range) {
    std::int32_t id = static_cast<std::int32_t>(sites_.size());
    if (free_.empty()) {
      sites_.emplace_back();
    } else {
      id = free_.back();
      free_.pop_back();
    }
    site(id) = {support, side, 0, 0, range};
    enter(id, 1);
  }

  void push(std::size_t slice, const Entry& entry) {
    heaps_[slice].push_back(entry);
    std::push_heap(heaps_[slice].begin(), heaps_[slice].end(), Higher());
  }
  Entry pop(std::size_t slice) {
    std::vector<Entry>& heap = heaps_[slice];
    std::pop_heap(heap.begin(), heap.end(), Higher());
    const Entry entry = heap.back();
    heap.pop_back();
    return entry;
  }

  void release(std::int32_t id) {
    if (--site(id).uses == 0) free_.push_back(id);
  }

  /// Squared distances are good to this [m^2]: rounding of a few products, with room to spare.
  double slack() const { return 1e-12 * largest_ * largest_; }

  double smallest_, largest_, lx_, ly_;
  Cells cells_;
  std::vector<LyingGrain> grains_;
  std::vector<Site> sites_;
  std::vector<std::int32_t> free_;
  Slices slices_;
  std::vector<std::vector<Entry>> heaps_;             ///< by slice
  std::vector<std::pair<Entry, std::size_t>> aside_;  ///< entries and their slices; scratch
  std::vector<Near> near_;                            ///< scratch
  RadiusRanges ranges_;                               ///< scratch
};

}  // namespace

std::vector<Vec3> deposit(std::span<const double> radii, double length_x, double length_y,
                          const std::function<void(std::size_t)>& placed) {
  std::vector<Vec3> centres;
  if (radii.empty()) return centres;
  for (std::size_t k = 0; k < radii.size(); ++k)
    if (!(radii[k] > 0 && 2 * radii[k] <= std::min(length_x, length_y)))
      throw std::invalid_argument("deposit: radius of grain " + std::to_string(k) +
                                  " must be > 0 and at most half of the base (" + std::to_string(length_x) +
                                  " m x " + std::to_string(length_y) + " m), got " +
                                  std::to_string(radii[k]) + " m");
  const auto [smallest, largest] = std::minmax_element(radii.begin(), radii.end());
  Deposition deposition(*smallest, *largest, length_x, length_y, radii.size());
  centres.reserve(radii.size());
  for (const double r : radii) {
    centres.push_back(deposition.place(r));
    if (placed) placed(centres.size());
  }
  return centres;
}

}  // namespace talus
