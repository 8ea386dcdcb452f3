#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <tuple>

#include "kernels/samples/detail/growing_cells.hpp"
#include "kernels/samples/detail/radius_slices.hpp"
#include "kernels/samples/detail/site_kernels.hpp"
#include "kernels/samples/resting_site.hpp"
#include "kernels/samples/sample.hpp"
#include "kernels/simd/instruction_set.hpp"

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
        heaps_(Slices::end),
        sieve_(best_instruction_set() == InstructionSet::portable ? site_kernels_portable
                                                                  : site_kernels_avx2) {
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
    sieve();
    for (const auto& [first, second] : pairs_) add_sites_on(g, near_[first], near_[second]);
  }

  struct Near {
    double gap;
    std::int32_t index;
    Obstacle obstacle;
  };

  /// Fills `pairs_` with what may be supports beside the youngest grain, the older one second. Most pairs
  /// have no site, and most of these show it by bounds, which several lanes look at together.
  void sieve() {
    for (std::vector<double>& component : components_) component.clear();
    const auto list = [&](const std::array<double, 7>& values) {
      for (std::size_t c = 0; c < values.size(); ++c) components_[c].push_back(values[c]);
    };
    constexpr double infinity = std::numeric_limits<double>::infinity();
    std::size_t floor = near_.size();
    for (const Near& n : near_) {
      const Obstacle& o = n.obstacle;
      if (n.index == floor_plane) floor = static_cast<std::size_t>(&n - near_.data());
      list({o.d[0], o.d[1], o.d[2], o.e0, o.e1, o.round ? 1.0 : 0.0,
            o.round ? grain(n.index).radius : infinity});
    }
    for (std::size_t k = 0; k < obstacle_padding; ++k) list({0, 0, 0, infinity, 0, 0, 0});
    const auto of = [&](std::size_t c) { return components_[c].data(); };
    const ObstacleView obstacles{of(0), of(1), of(2), of(3), of(4), of(5), of(6), near_.size(), floor};
    const SiteRule rule{grains_.back().radius, smallest_, largest_, stable_slack, clear_slack()};
    possible_.resize(near_.size() + obstacle_padding);
    pairs_.clear();
    for (std::uint32_t one = 0; one < near_.size(); ++one) {
      sieve_(obstacles, one, rule, possible_.data());
      for (std::uint32_t k = one + 1; k < near_.size(); ++k)
        if (possible_[k] != 0)
          pairs_.push_back(std::minmax(
              one, k, [&](std::uint32_t a, std::uint32_t b) { return near_[a].index > near_[b].index; }));
    }
    std::sort(pairs_.begin(), pairs_.end());
  }

  /// The sites on grain g and two obstacles near it, in descending order.
  void add_sites_on(std::int32_t g, const Near& first, const Near& second) {
    const bool on_floor = first.index == floor_plane || second.index == floor_plane;
    for (const int side : {1, -1}) {
      if (side < 0 && !on_floor) return;
      SiteCurve curve;
      if (!site_curve(grains_.back().radius, first.obstacle, second.obstacle, side, curve)) return;
      ranges_.assign(1, {smallest_, largest_});
      bound_root(ranges_[0], curve);
      keep_real(curve, ranges_);
      if (!on_floor && !ranges_.empty())
        keep_stable(curve, first.obstacle, second.obstacle, stable_slack, ranges_);
      for (const Near& n : near_) {
        if (ranges_.empty()) break;
        if (n.index != first.index && n.index != second.index)
          keep_clear(curve, n.obstacle, clear_slack(), ranges_);
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
  double clear_slack() const { return 0.5 * slack(); }
  static constexpr double stable_slack = 1e-12;

  double smallest_, largest_, lx_, ly_;
  detail::GrowingCells cells_;
  std::vector<LyingGrain> grains_;
  std::vector<Site> sites_;
  std::vector<std::int32_t> free_;
  Slices slices_;
  std::vector<std::vector<Entry>> heaps_;             ///< by slice
  std::vector<std::pair<Entry, std::size_t>> aside_;  ///< entries and their slices; scratch
  SieveSites sieve_;
  std::vector<Near> near_;                                      ///< scratch
  std::array<std::vector<double>, 7> components_;               ///< of what is near; scratch
  std::vector<unsigned char> possible_;                         ///< scratch
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs_;  ///< of what is near; scratch
  RadiusRanges ranges_;                                         ///< scratch
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
