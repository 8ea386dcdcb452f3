#include "kernels/shapes/region.hpp"

#include <Eigen/Geometry>

#include <cmath>
#include <limits>

namespace talus {

namespace {

/// A cylinder, or a disc as one of no length: from `foot` along the unit vector `axis`.
struct Round {
  Vec3 foot, axis;
  double length;  ///< [m]
};

Round round_of(const Region& region) {
  if (region.kind == Region::Kind::disc) return {region.centre, region.axis / region.axis.norm(), 0};
  const Vec3 way = region.end - region.start;
  return {region.start, way / way.norm(), way.norm()};
}

/// Unit, at right angles to a unit vector: the same for the same vector.
Vec3 beside(const Vec3& axis) {
  Eigen::Index least = 0;
  axis.cwiseAbs().minCoeff(&least);
  const Vec3 across = axis.cross(Vec3::Unit(least));
  return across / across.norm();
}

}  // namespace

const char* fault_of(const Region& region) {
  switch (region.kind) {
    case Region::Kind::box:
      return (region.high - region.low).minCoeff() > 0 ? ""
                                                       : "every number of `high` must exceed that of `low`";
    case Region::Kind::cylinder:
      return (region.end - region.start).norm() > 0 ? "" : "`start` and `end` must not be the same point";
    case Region::Kind::disc:
      return region.axis.norm() > 0 ? "" : "`axis` must not be zero";
    case Region::Kind::beyond:
    case Region::Kind::plane:
      return region.normal.norm() > 0 ? "" : "`normal` must not be zero";
  }
  return "";
}

bool contains(const Region& region, const Vec3& x) {
  switch (region.kind) {
    case Region::Kind::box:
      return (x.array() >= region.low.array()).all() && (x.array() <= region.high.array()).all();
    case Region::Kind::cylinder:
      return holds(region, x, 0);
    case Region::Kind::disc:
    case Region::Kind::plane:
      return false;
    case Region::Kind::beyond:
      return (x - region.point).dot(region.normal) > 0;
  }
  return false;
}

bool holds(const Region& region, const Vec3& x, double radius) {
  if (region.kind == Region::Kind::beyond)
    return (x - region.point).dot(region.normal) >= radius * region.normal.norm();
  if (region.kind == Region::Kind::plane) return false;
  if (region.kind == Region::Kind::box)
    return (x.array() - radius >= region.low.array()).all() &&
           (x.array() + radius <= region.high.array()).all();
  const Round round = round_of(region);
  const double along = (x - round.foot).dot(round.axis);
  const double room = region.radius - radius;
  if (room < 0 || (x - round.foot - along * round.axis).squaredNorm() > room * room) return false;
  return region.kind == Region::Kind::disc ? along == 0 : along >= radius && along <= round.length - radius;
}

bool has_room(const Region& region, double radius) {
  switch (region.kind) {
    case Region::Kind::box:
      return (region.high - region.low).minCoeff() >= 2 * radius;
    case Region::Kind::cylinder:
      return region.radius >= radius && round_of(region).length >= 2 * radius;
    case Region::Kind::disc:
      return region.radius >= radius;
    case Region::Kind::beyond:
      return true;
    case Region::Kind::plane:
      return false;
  }
  return false;
}

Bounds bounds_of(const Region& region) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  if (region.kind == Region::Kind::box) return {region.low, region.high};
  if (!region.is_round()) return {Vec3::Constant(-infinity), Vec3::Constant(infinity)};
  const Round round = round_of(region);
  const Vec3 other_end = round.foot + round.length * round.axis;
  const Vec3 across = region.radius * (1 - round.axis.array().square()).max(0).sqrt();
  return {round.foot.cwiseMin(other_end) - across, round.foot.cwiseMax(other_end) + across};
}

Place place_in(const Region& region, double radius, const std::array<double, 3>& numbers) {
  const auto& [a, b, c] = numbers;
  if (region.kind == Region::Kind::box) {
    const Vec3 room = (region.high - region.low).array() - 2 * radius;
    return {true, region.low + Vec3::Constant(radius) + Vec3(a * room[0], b * room[1], c * room[2])};
  }
  const double x = 2 * a - 1, y = 2 * b - 1;
  if (x * x + y * y > 1) return {};
  const Round round = round_of(region);
  const Vec3 first = beside(round.axis), second = round.axis.cross(first);
  const double along = region.kind == Region::Kind::disc ? 0 : radius + c * (round.length - 2 * radius);
  return {true, round.foot + along * round.axis + (region.radius - radius) * (x * first + y * second)};
}

}  // namespace talus
