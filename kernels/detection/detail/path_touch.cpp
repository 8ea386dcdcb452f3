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

/// How a wall goes on beside the point of it that a sphere has before it.
enum class Bend { none, hollow, wide, sharp };

/// By a place so little further on `way` that the normal of an edge has turned by PathThresholds::flat: an
/// edge falls back behind the plane of the normal by distance (1 - cos), what bends about more than the
/// distance of the sphere by more than twice that for the angle by which its normal turns.
Bend bend_at(const Wall& wall, const Vec3& centre, const Vec3& way, const SurfacePoint& point) {
  constexpr WallPathThresholds thresholds;
  const double along = point.normal.dot(way), aside = (way - along * point.normal).norm();
  const double part = std::min(1.0, PathThresholds{}.flat * point.distance / aside);
  const SurfacePoint next = point_at(wall, centre + part * way, point.feature);
  const double turn2 = (next.normal - point.normal).squaredNorm();
  if (turn2 < thresholds.still * thresholds.still) return Bend::none;
  const double back = next.distance - point.distance - part * along;
  if (back <= 0) return Bend::hollow;
  return back < next.distance * turn2 ? Bend::sharp : Bend::wide;
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

SurfacePoint touch_on_path(const Wall& wall, const Vec3& centre, double radius, const PathOfStep& path,
                           const SurfacePoint& point) {
  constexpr WallPathThresholds thresholds;
  const Vec3& way = path.way;
  const double gap = point.distance - radius;
  const auto nears = [&](const SurfacePoint& now) { return now.normal.dot(way) < 0; };
  const auto outside = [&](const SurfacePoint& now) { return now.distance > radius; };
  if (!(gap > path.held && nears(point) && gap + point.normal.dot(path.loaded) < 0)) return point;
  if (wall.surface()->goes_round(point.feature)) return point;
  if ((point_at(wall, centre + way, point.feature).normal - point.normal).norm() < PathThresholds{}.flat)
    return point;
  const Bend bend = bend_at(wall, centre, way, point);
  if (bend == Bend::hollow) return point;
  std::int32_t feature = point.feature;
  for (int k = 0; k < thresholds.features; ++k) {
    const auto at = [&](double part) { return point_at(wall, centre + part * way, feature); };
    OnWay nearest{1, at(1)};
    if (!nears(nearest.point)) nearest = end_of(at, nears, nearest, thresholds.halvings);
    const bool passes = outside(nearest.point);
    OnWay met = passes ? nearest : end_of(at, outside, nearest, thresholds.halvings);
    const std::int32_t counts = counting(wall, centre + met.part * way, met.point);
    if (counts < 0) return point;
    if (counts != feature) {
      feature = counts;
      continue;
    }
    // Where it comes from: a face that it leaves over an edge, or the edge itself.
    const Bend there = bend_at(wall, centre + met.part * way, -way, met.point);
    if (there == Bend::hollow) return point;
    if (bend != Bend::sharp && there != Bend::sharp) {
      if (!passes) return point;
      met = {1, point};
      met.point.distance = nearest.point.distance;
    }
    // What passes by may be carried by others, and gains nothing by its weight.
    const double by_loads = met.point.normal.dot(way - path.loaded);
    if (passes) met.point.distance += std::clamp(by_loads, 0.0, gap);
    met.point.distance -= met.part * met.point.normal.dot(way);
    met.point.feature = point.feature;
    return met.point;
  }
  return point;
}

}  // namespace talus::detail
