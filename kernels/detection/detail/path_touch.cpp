#include "kernels/detection/detail/path_touch.hpp"

#include <algorithm>
#include <vector>

#include "kernels/detection/detail/pair_path.hpp"

namespace talus::detail {

namespace {

/// A part of the way, and the point there.
struct OnWay {
  double part = 0;
  SurfacePoint point;
};

/// The end of the part of a way on which `before` holds, which does so at its beginning and not at `last`.
template <class At, class Before>
OnWay end_of(const At& at, const Before& before, OnWay last, int halvings) {
  double low = 0;
  for (int k = 0; k < halvings; ++k) {
    const double middle = (low + last.part) / 2;
    const SurfacePoint point = at(middle);
    if (before(point))
      low = middle;
    else
      last = {middle, point};
  }
  return last;
}

/// How a wall goes on beside the point of it that a sphere has before it now.
enum class Bend { none, hollow, wide, sharp };

/// By a place a little further on the way: an edge falls back by distance (1 - cos) of the angle by which the
/// normal turns, what bends about more than the distance of the sphere by twice that and more.
Bend bend_at(const SurfacePoint& first, const Vec3& way, const OnWay& next) {
  const double turn2 = (next.point.normal - first.normal).squaredNorm();
  if (turn2 < PathThresholds{}.still * PathThresholds{}.still) return Bend::none;
  const double back = next.point.distance - first.distance - next.part * first.normal.dot(way);
  if (back <= 0) return Bend::hollow;
  return back < next.point.distance * turn2 ? Bend::sharp : Bend::wide;
}

Vec3 touched(const Vec3& centre, const SurfacePoint& point) {
  return centre - point.distance * point.normal;
}

/// Which feature counts instead of one that a sphere has before it at this centre: the same, or the one that
/// is nearest to it of those that the sphere touches (kernels/shapes/surface.hpp); -1: none.
std::int32_t counting(const Wall& wall, const Vec3& centre, const SurfacePoint& point) {
  std::vector<SurfacePoint> points;
  collide(wall, centre, 2 * point.distance, points);
  if (std::ranges::find(points, point.feature, &SurfacePoint::feature) != points.end()) return point.feature;
  const auto away = [&](const SurfacePoint& other) {
    return (touched(centre, other) - touched(centre, point)).squaredNorm();
  };
  const auto nearest = std::ranges::min_element(points, {}, away);
  return nearest == points.end() ? -1 : nearest->feature;
}

}  // namespace

SurfacePoint touch_on_path(const Wall& wall, const Vec3& centre, double radius, const Vec3& way,
                           const Vec3& loaded, const SurfacePoint& point) {
  constexpr PathThresholds thresholds;
  const double gap = point.distance - radius;
  const auto nears = [&](const SurfacePoint& now) { return now.normal.dot(way) < 0; };
  const auto outside = [&](const SurfacePoint& now) { return now.distance > radius; };
  if (!(gap > 0 && nears(point) && gap + point.normal.dot(loaded) < 0)) return point;
  std::int32_t feature = point.feature;
  for (int k = 0; k < thresholds.features; ++k) {
    const auto at = [&](double part) { return point_at(wall, centre + part * way, feature); };
    OnWay nearest{1, at(1)};
    if (k == 0 && (nearest.point.normal - point.normal).norm() < thresholds.flat) return point;
    if (!nears(nearest.point)) nearest = end_of(at, nears, nearest, thresholds.halvings);
    const bool passes = outside(nearest.point);
    OnWay met = passes ? nearest : end_of(at, outside, nearest, thresholds.halvings);
    const std::int32_t counts = counting(wall, centre + met.part * way, met.point);
    if (counts >= 0 && counts != feature) {
      feature = counts;
      continue;
    }
    const Bend bends = bend_at(point, way, {thresholds.next, at(thresholds.next)});
    if (counts < 0 || bends == Bend::hollow) return point;
    if (bends != Bend::sharp) {
      if (!passes) return point;
      met = {1, point};
      met.point.distance = nearest.point.distance;
    }
    // What passes by may be carried by others, and gains nothing by its weight.
    const double by_loads = met.point.normal.dot(way - loaded);
    if (passes) met.point.distance += std::clamp(by_loads, 0.0, gap);
    met.point.distance -= met.part * met.point.normal.dot(way);
    return met.point;
  }
  return point;
}

}  // namespace talus::detail
