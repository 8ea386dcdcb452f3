#include "kernels/shapes/detail/revolution.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "kernels/shapes/detail/plate.hpp"

namespace talus::detail {

namespace {

/// Distance from the axis, and along it from the first end [m].
using Flat = Eigen::Vector2d;

Flat nearest_on(const Flat& a, const Flat& b, const Flat& p) {
  const Flat ab = b - a;
  const double length2 = ab.squaredNorm();
  return length2 > 0 ? Flat(a + std::clamp((p - a).dot(ab) / length2, 0.0, 1.0) * ab) : a;
}

class Revolution final : public Surface {
 public:
  explicit Revolution(const Frustum& given)
      : given_(given),
        length_((given.end[1] - given.end[0]).norm()),
        axis_((given.end[1] - given.end[0]) / length_) {
    side_ = any_side(axis_);
  }

  Bounds bounds() const override {
    const Vec3 flat = (Vec3::Ones() - axis_.cwiseAbs2()).cwiseMax(0).cwiseSqrt();
    Bounds box{given_.end[0] - given_.radius[0] * flat, given_.end[0] + given_.radius[0] * flat};
    box.low = box.low.cwiseMin(given_.end[1] - given_.radius[1] * flat);
    box.high = box.high.cwiseMax(given_.end[1] + given_.radius[1] * flat);
    return box;
  }

  void show(std::vector<Triangle>& triangles) const override {
    const std::vector<Vec3> low = circle_corners(given_.end[0], axis_, side_, given_.radius[0]),
                            high = circle_corners(given_.end[1], axis_, side_, given_.radius[1]);
    for (std::size_t k = 0; k < low.size(); ++k) {
      const std::size_t next = (k + 1) % low.size();
      if (given_.radius[0] > 0) triangles.push_back({low[k], low[next], high[next]});
      if (given_.radius[1] > 0) triangles.push_back({low[k], high[next], high[k]});
    }
    if (given_.shell) return;
    if (given_.radius[0] > 0) show_disc(given_.end[0], {low.rbegin(), low.rend()}, triangles);
    if (given_.radius[1] > 0) show_disc(given_.end[1], high, triangles);
  }
  bool turns_in_itself(const Vec3& axis, const Vec3& point) const override {
    return on_axis(axis, point, axis_, given_.end[0]);
  }
  SurfacePoint at(const Vec3& centre, std::int32_t feature) const override {
    return given_.shell ? on_shell(centre, feature) : on_solid(centre);
  }

  bool goes_round(std::int32_t feature) const override { return given_.shell && feature > 0; }

  void near(const Vec3& centre, double reach, std::vector<std::int32_t>& features) const override {
    if (!(at(centre, 0).distance < reach)) return;
    features.push_back(0);
    // The other points of a circle are at least its radius from a centre inside it.
    const double z = along(centre);
    const double narrow = std::min(radius_at(z - reach), radius_at(z + reach));
    if (given_.shell && narrow < reach) features.insert(features.end(), {1, 2});
  }

  void collide(const Vec3& centre, double reach, std::vector<SurfacePoint>& points) const override {
    const SurfacePoint first = at(centre, 0);
    if (!(first.distance < reach)) return;
    points.push_back(first);
    if (!given_.shell) return;
    const Vec3 point = centre - first.distance * first.normal - given_.end[0];
    const Vec3 d = centre - given_.end[0];
    // From outside, the other points of the circle are behind the shell.
    if ((d - d.dot(axis_) * axis_).squaredNorm() > (point - point.dot(axis_) * axis_).squaredNorm()) return;
    for (const std::int32_t feature : {1, 2})
      if (const SurfacePoint other = at(centre, feature); other.distance < reach) points.push_back(other);
  }

 private:
  double along(const Vec3& centre) const { return (centre - given_.end[0]).dot(axis_); }
  double radius_at(double z) const {
    const double part = std::clamp(z / length_, 0.0, 1.0);
    return given_.radius[0] + part * (given_.radius[1] - given_.radius[0]);
  }
  /// The direction from the axis to a centre; any, but always the same one, on the axis.
  Vec3 outward(const Vec3& radial) const {
    const double distance = radial.norm();
    return distance > 1e-9 * std::max(given_.radius[0], given_.radius[1]) ? Vec3(radial / distance) : side_;
  }

  SurfacePoint on_shell(const Vec3& centre, std::int32_t feature) const {
    constexpr double cosine[3] = {1, -0.5, -0.5}, sine[3] = {0, 0.86602540378443865, -0.86602540378443865};
    const Vec3 d = centre - given_.end[0];
    const double z = d.dot(axis_);
    const Vec3 radial = d - z * axis_, out = outward(radial);
    const auto k = static_cast<std::size_t>(feature);
    const Vec3 direction = cosine[k] * out + sine[k] * axis_.cross(out);
    const Flat low(given_.radius[0], 0), high(given_.radius[1], length_);
    const Flat point = nearest_on(low, high, {radial.dot(direction), z});
    return facing(centre, given_.end[0] + point[0] * direction + point[1] * axis_, -direction, feature);
  }

  SurfacePoint on_solid(const Vec3& centre) const {
    const Vec3 d = centre - given_.end[0];
    const double z = d.dot(axis_);
    const Vec3 radial = d - z * axis_, out = outward(radial);
    const Flat p(radial.norm(), z);
    const std::array<Flat, 4> corner = {Flat(0, 0), Flat(given_.radius[0], 0),
                                        Flat(given_.radius[1], length_), Flat(0, length_)};
    const bool inside = z > 0 && z < length_ && p[0] < radius_at(z);
    double best = std::numeric_limits<double>::infinity();
    Flat normal(0, 1);
    for (std::size_t k = 0; k < 3; ++k) {
      const Flat side = corner[k + 1] - corner[k];
      if (!(side.norm() > 0)) continue;  // the apex of a cone
      const Flat way = p - nearest_on(corner[k], corner[k + 1], p);
      const double distance = way.norm();
      if (distance >= best) continue;
      best = distance;
      // The corners go round the solid with its inside on the left.
      normal = inside || distance == 0 ? Flat(Flat(side[1], -side[0]) / side.norm()) : Flat(way / distance);
    }
    return {0, inside ? -best : best, normal[0] * out + normal[1] * axis_};
  }

  Frustum given_;
  double length_;  ///< along the axis [m]
  Vec3 axis_;      ///< unit, from the first end to the second
  Vec3 side_;      ///< unit, at right angles to the axis
};

}  // namespace

std::shared_ptr<const Surface> make_frustum(const Frustum& frustum) {
  if (!((frustum.end[1] - frustum.end[0]).norm() > 0))
    throw std::invalid_argument("start and end must be apart");
  return std::make_shared<Revolution>(frustum);
}

}  // namespace talus::detail
