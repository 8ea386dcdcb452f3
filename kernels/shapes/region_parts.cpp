#include "kernels/shapes/region_parts.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace talus {

namespace {

constexpr double pi = std::numbers::pi;

/// Of a unit sphere: the volume between the planes z = low and z = high, both in [-1, 1].
double between_planes(double low, double high) {
  return pi * (high - low - (high * high * high - low * low * low) / 3);
}

/// Of a disc about 0: the area between 0 and a along x, 0 and b along y, negative where one of them is.
double area_to(double a, double b, double radius) {
  const double sign = (a < 0) != (b < 0) ? -1 : 1;
  a = std::min(std::abs(a), radius);
  b = std::min(std::abs(b), radius);
  if (a * a + b * b <= radius * radius) return sign * a * b;
  const auto under_arc = [radius](double x) {
    const double height = std::sqrt(std::max(0.0, radius * radius - x * x));
    return 0.5 * (x * height + radius * radius * std::asin(std::min(1.0, x / radius)));
  };
  const double corner = std::sqrt(radius * radius - b * b);
  return sign * (b * corner + under_arc(a) - under_arc(corner));
}

/// Area common to two discs whose centres are `distance` apart.
double common_area(double distance, double r, double s) {
  if (distance >= r + s) return 0;
  const double smaller = std::min(r, s);
  if (distance <= std::abs(r - s)) return pi * smaller * smaller;
  const double to_r = (distance * distance + r * r - s * s) / (2 * distance), to_s = distance - to_r;
  const auto segment = [](double radius, double to) {
    const double half = std::sqrt(std::max(0.0, radius * radius - to * to));
    return radius * radius * std::atan2(half, to) - to * half;
  };
  return segment(r, to_r) + segment(s, to_s);
}

/// Integral of f over the angles from `low` to `high`: Gauss's rule with five points in each panel.
template <class F>
double over_angles(double low, double high, const F& f) {
  constexpr int panels = 6;
  constexpr std::array<double, 5> place{-0.9061798459386640, -0.5384693101056831, 0, 0.5384693101056831,
                                        0.9061798459386640};
  constexpr std::array<double, 5> weight{0.2369268850561891, 0.4786286704993665, 0.5688888888888889,
                                         0.4786286704993665, 0.2369268850561891};
  const double half = 0.5 * (high - low) / panels;
  double sum = 0;
  for (int p = 0; p < panels; ++p)
    for (std::size_t k = 0; k < place.size(); ++k)
      sum += weight[k] * half * f(low + half * (2 * p + 1 + place[k]));
  return sum;
}

/// Integral of `area`(radius of the slice) over the slices of a unit sphere from z = low to high, in the
/// angle, so that the slices' radii are smooth. `kinks`: radii at which the area is not; it is integrated up
/// to them.
template <std::size_t n, class Area>
double over_slices(double low, double high, const std::array<double, n>& kinks, const Area& area) {
  std::array<double, 2 * n + 2> ends{};
  const double first = std::asin(low), last = std::asin(high);
  for (std::size_t k = 0; k < n; ++k) {
    const double angle = kinks[k] < 1 ? std::acos(std::max(0.0, kinks[k])) : 0;
    ends[2 * k] = std::clamp(angle, first, last);
    ends[2 * k + 1] = std::clamp(-angle, first, last);
  }
  ends[2 * n] = first;
  ends[2 * n + 1] = last;
  std::ranges::sort(ends);
  double sum = 0;
  for (std::size_t k = 1; k < ends.size(); ++k)
    if (ends[k] > ends[k - 1])
      sum += over_angles(ends[k - 1], ends[k],
                         [&](double angle) { return std::cos(angle) * area(std::cos(angle)); });
  return sum;
}

/// Of a unit sphere about 0.
double unit_sphere_in_box(const Vec3& low, const Vec3& high) {
  const Vec3 from = low.cwiseMax(-1), to = high.cwiseMin(1);
  if ((to - from).minCoeff() <= 0) return 0;
  Eigen::Index cut = 0, cuts = 0;
  for (Eigen::Index k = 0; k < 3; ++k)
    if (from[k] > -1 || to[k] < 1) cut = k, ++cuts;
  if (cuts <= 1) return between_planes(from[cut], to[cut]);
  const Eigen::Index a = (cut + 1) % 3, b = (cut + 2) % 3;
  const std::array<double, 8> kinks{std::abs(from[a]),
                                    std::abs(to[a]),
                                    std::abs(from[b]),
                                    std::abs(to[b]),
                                    std::hypot(from[a], from[b]),
                                    std::hypot(from[a], to[b]),
                                    std::hypot(to[a], from[b]),
                                    std::hypot(to[a], to[b])};
  return over_slices(from[cut], to[cut], kinks, [&](double radius) {
    return area_to(to[a], to[b], radius) - area_to(from[a], to[b], radius) - area_to(to[a], from[b], radius) +
           area_to(from[a], from[b], radius);
  });
}

/// Of a unit sphere about 0, and a cylinder from `low` to `high` along an axis that is `distance` away.
double unit_sphere_in_cylinder(double low, double high, double distance, double radius) {
  const double from = std::max(low, -1.0), to = std::min(high, 1.0);
  if (to <= from || distance >= radius + 1) return 0;
  if (distance + 1 <= radius) return between_planes(from, to);
  const std::array<double, 2> kinks{std::abs(radius - distance), radius + distance};
  return over_slices(from, to, kinks, [&](double slice) { return common_area(distance, radius, slice); });
}

/// Where a point is, seen from a cylinder: along its axis from the first end, and across it.
struct Seen {
  double along;
  Vec3 across;
};
Seen seen_from(const Region& cylinder, const Vec3& x) {
  const Vec3 way = cylinder.end - cylinder.start, axis = way / way.norm();
  const double along = (x - cylinder.start).dot(axis);
  return {along, x - cylinder.start - along * axis};
}

/// A part of a way, as far as it is left.
struct Interval {
  double begin = 0, end = 1;
  /// Keeps where low <= at + s along <= high.
  void cut(double at, double along, double low, double high) {
    if (along == 0) {
      if (at < low || at > high) end = begin;
      return;
    }
    const double to_low = (low - at) / along, to_high = (high - at) / along;
    begin = std::max(begin, std::min(to_low, to_high));
    end = std::min(end, std::max(to_low, to_high));
  }
  double length() const { return std::max(0.0, end - begin); }
};

constexpr double infinity = std::numeric_limits<double>::infinity();

double part_in_cylinder(const Region& region, const Vec3& a, const Vec3& b) {
  const Seen from = seen_from(region, a), to = seen_from(region, b);
  Interval left;
  left.cut(from.along, to.along - from.along, 0, (region.end - region.start).norm());
  const Vec3 way = to.across - from.across;
  const double square = way.squaredNorm(), half = from.across.dot(way),
               rest = from.across.squaredNorm() - region.radius * region.radius;
  if (square == 0) return rest <= 0 ? left.length() : 0;
  const double root = half * half - square * rest;
  if (root <= 0) return 0;
  left.cut(half, square, -std::sqrt(root), std::sqrt(root));
  return left.length();
}

}  // namespace

double volume_of(const Region& region) {
  if (region.kind == Region::Kind::box) return (region.high - region.low).prod();
  if (region.kind == Region::Kind::cylinder)
    return pi * region.radius * region.radius * (region.end - region.start).norm();
  return 0;
}

double sphere_part(const Region& region, const Vec3& x, double radius) {
  const double cube = radius * radius * radius;
  if (region.kind == Region::Kind::box)
    return cube * unit_sphere_in_box((region.low - x) / radius, (region.high - x) / radius);
  if (region.kind != Region::Kind::cylinder) return 0;
  const auto [along, across] = seen_from(region, x);
  const double length = (region.end - region.start).norm();
  return cube * unit_sphere_in_cylinder(-along / radius, (length - along) / radius, across.norm() / radius,
                                        region.radius / radius);
}

double way_part(const Region& region, const Vec3& a, const Vec3& b) {
  if (a == b) return contains(region, a) ? 1 : 0;
  if (region.kind == Region::Kind::cylinder) return part_in_cylinder(region, a, b);
  Interval left;
  if (region.kind == Region::Kind::box)
    for (Eigen::Index k = 0; k < 3; ++k) left.cut(a[k], b[k] - a[k], region.low[k], region.high[k]);
  else if (region.kind == Region::Kind::beyond)
    left.cut((a - region.point).dot(region.normal), (b - a).dot(region.normal), 0, infinity);
  else
    return 0;
  return left.length();
}

int passage(const Region& surface, const Vec3& from, const Vec3& to) {
  const bool disc = surface.kind == Region::Kind::disc;
  const Vec3& point = disc ? surface.centre : surface.point;
  const Vec3& normal = disc ? surface.axis : surface.normal;
  const double before = (from - point).dot(normal), after = (to - point).dot(normal);
  if ((before > 0) == (after > 0)) return 0;
  if (disc) {
    const Vec3 through = from + before / (before - after) * (to - from);
    if ((through - point).squaredNorm() > surface.radius * surface.radius) return 0;
  }
  return after > 0 ? 1 : -1;
}

}  // namespace talus
