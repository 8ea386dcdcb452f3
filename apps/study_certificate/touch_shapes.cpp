#include "apps/study_certificate/touch_shapes.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace talus::audit {

namespace {

/// Of a thin plate: from whichever side; `side` for a centre in the plate itself.
WallTouch from_point(const Vec3& centre, const Vec3& nearest, const Vec3& side) {
  const double distance = (centre - nearest).norm();
  return {distance, distance > 0 ? Vec3((centre - nearest) / distance) : side};
}

std::vector<WallTouch> touch_disc(const ShapeValues& values, const Vec3& centre) {
  const Vec3 axis = values.vector("axis").normalized(), middle = values.vector("centre");
  const double height = axis.dot(centre - middle), radius = values.scalar("radius");
  const Vec3 foot = centre - height * axis;
  const double out = (foot - middle).norm();
  return {from_point(centre, out <= radius ? foot : Vec3(middle + radius / out * (foot - middle)), axis)};
}

std::vector<WallTouch> touch_rectangle(const ShapeValues& values, const Vec3& centre) {
  const Vec3 corner = values.vector("corner"), a = values.vector("edge_a"), b = values.vector("edge_b");
  const double s = std::clamp(a.dot(centre - corner) / a.squaredNorm(), 0.0, 1.0),
               t = std::clamp(b.dot(centre - corner) / b.squaredNorm(), 0.0, 1.0);
  return {from_point(centre, corner + s * a + t * b, a.cross(b).normalized())};
}

/// The line between two circles about one axis.
struct Profile {
  Vec3 start, axis;                         ///< [m]; unit
  double length, start_radius, end_radius;  ///< [m]

  /// The point on the line in the half plane of a direction (unit, at right angles to the axis) that is
  /// nearest to a point there, `out` from the axis along it and `up` along the axis.
  Vec3 nearest(const Vec3& direction, double out, double up) const {
    const double lean = end_radius - start_radius;
    const double part =
        std::clamp(((out - start_radius) * lean + up * length) / (lean * lean + length * length), 0.0, 1.0);
    return start + part * length * axis + (start_radius + part * lean) * direction;
  }
};

Profile profile_of(const WallShape& shape) {
  const ShapeValues& values = shape.values;
  const Vec3 way = values.vector("end") - values.vector("start");
  const bool cone = shape.name == "cone";
  return {values.vector("start"), way.normalized(), way.norm(),
          values.scalar(cone ? "start_radius" : "radius"), values.scalar(cone ? "end_radius" : "radius")};
}

/// A shell: the nearest point and, where the sphere is inside, those a third of a turn away from it.
std::vector<WallTouch> touch_shell(const Profile& profile, const Vec3& centre) {
  const double up = profile.axis.dot(centre - profile.start);
  const Vec3 radial = centre - profile.start - up * profile.axis;
  const double out = radial.norm();
  const Vec3 direction = out > 0 ? Vec3(radial / out) : profile.axis.unitOrthogonal();
  const Vec3 nearest = profile.nearest(direction, out, up);
  std::vector<WallTouch> all = {from_point(centre, nearest, -direction)};
  const double radius_there = direction.dot(nearest - profile.start);
  if (out > radius_there) return all;
  for (const double turn : {2 * std::numbers::pi / 3, -2 * std::numbers::pi / 3}) {
    const Vec3 other = Eigen::AngleAxisd(turn, profile.axis) * direction;
    all.push_back(from_point(centre, profile.nearest(other, radial.dot(other), up), -other));
    all.back().beside = true;
  }
  return all;
}

/// A solid with closed ends.
std::vector<WallTouch> touch_solid(const Profile& profile, const Vec3& centre) {
  const double up = profile.axis.dot(centre - profile.start);
  const Vec3 radial = centre - profile.start - up * profile.axis;
  const double out = radial.norm();
  const Vec3 direction = out > 0 ? Vec3(radial / out) : profile.axis.unitOrthogonal();
  const double lean = profile.end_radius - profile.start_radius, slant = std::hypot(lean, profile.length);
  // Signed distances from the planes of its ends, and from the cone of its side.
  const double below = -up, above = up - profile.length,
               beside = ((out - profile.start_radius) * profile.length - up * lean) / slant;
  const Vec3 side = (profile.length * direction - lean * profile.axis) / slant;
  if (below < 0 && above < 0 && beside < 0) {
    if (beside >= below && beside >= above) return {{beside, side}};
    return {below > above ? WallTouch{below, -profile.axis} : WallTouch{above, profile.axis}};
  }
  const auto on_end = [&](double height, double radius) {
    return Vec3(profile.start + height * profile.axis + std::min(out, radius) * direction);
  };
  WallTouch best{INFINITY, side};
  for (const Vec3& point : {profile.nearest(direction, out, up), on_end(0, profile.start_radius),
                            on_end(profile.length, profile.end_radius)})
    if (const WallTouch touch = from_point(centre, point, side); touch.distance < best.distance) best = touch;
  return {best};
}

Vec3 nearest_on_segment(const Vec3& a, const Vec3& b, const Vec3& p) {
  return a + std::clamp((p - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0) * (b - a);
}

/// The foot of the perpendicular where it is in the triangle, else the nearest point of the three edges.
Vec3 nearest_in(const Triangle& triangle, const Vec3& normal, const Vec3& p) {
  const Vec3 foot = p - normal.dot(p - triangle[0]) * normal;
  bool within = true;
  Vec3 best = triangle[0];
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3 &a = triangle[k], &b = triangle[(k + 1) % 3];
    within = within && (b - a).cross(foot - a).dot(normal) >= 0;
    if (const Vec3 near = nearest_on_segment(a, b, p); (near - p).norm() < (best - p).norm()) best = near;
  }
  return within ? foot : best;
}

/// Places nearer to one another than this, over the distance of the sphere's centre, are one.
constexpr double one_place = 1e-6;

/// The nearest point of each triangle, unless another triangle that has it, too, comes nearer to the centre;
/// of points in one place the first. From behind nothing is touched.
std::vector<WallTouch> touch_mesh(std::span<const Triangle> triangles, bool inside, const Vec3& centre,
                                  double reach) {
  struct Near {
    Triangle triangle;
    Vec3 normal, point;
    double distance;
    bool in_front;
  };
  std::vector<Near> near;
  for (const Triangle& triangle : triangles) {
    const Vec3 outward = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]).normalized();
    const Vec3 point = nearest_in(triangle, outward, centre), normal = inside ? Vec3(-outward) : outward;
    const double distance = (centre - point).norm();
    if (distance < reach)
      near.push_back({triangle, normal, point, distance, normal.dot(centre - point) >= 0});
  }
  std::vector<WallTouch> all;
  for (std::size_t k = 0; k < near.size(); ++k) {
    const Near& one = near[k];
    bool counts = true, in_front = one.in_front;
    for (std::size_t j = 0; j < near.size(); ++j) {
      const Near& other = near[j];
      const double slack = one_place * one.distance;
      const Vec3 normal = other.normal;
      if (j == k ||
          (nearest_in(other.triangle, inside ? Vec3(-normal) : normal, one.point) - one.point).norm() > slack)
        continue;
      if ((other.point - one.point).norm() <= slack)
        counts = counts && k < j, in_front = in_front || other.in_front;
      else
        counts = counts && other.distance >= one.distance;
    }
    if (counts && in_front) all.push_back(from_point(centre, one.point, one.normal));
  }
  return all;
}

}  // namespace

bool knows_shape(std::string_view name) {
  constexpr std::array known = {"plane", "disc", "rectangle", "cylinder", "cone", "mesh"};
  return std::ranges::find(known, name) != known.end();
}

std::vector<WallTouch> touches_of(const WallShape& shape, std::span<const Triangle> triangles,
                                  const Vec3& centre, double reach) {
  const bool inside = shape.values.truth("inside");
  if (shape.name == "disc") return touch_disc(shape.values, centre);
  if (shape.name == "rectangle") return touch_rectangle(shape.values, centre);
  if (shape.name == "mesh") return touch_mesh(triangles, inside, centre, reach);
  const Profile profile = profile_of(shape);
  return inside ? touch_shell(profile, centre) : touch_solid(profile, centre);
}

}  // namespace talus::audit
