#include <algorithm>
#include <stdexcept>

#include "kernels/shapes/detail/plate.hpp"
#include "kernels/shapes/shape.hpp"

namespace talus {

namespace {

/// A disc without thickness, touched from both sides and at its rim.
class Disc final : public Surface {
 public:
  Disc(const Vec3& centre, const Vec3& axis, double radius)
      : centre_(centre), axis_(axis.normalized()), radius_(radius) {}

  Bounds bounds() const override {
    const Vec3 half = radius_ * (Vec3::Ones() - axis_.cwiseAbs2()).cwiseMax(0).cwiseSqrt();
    return {centre_ - half, centre_ + half};
  }
  void show(std::vector<Triangle>& triangles) const override {
    detail::show_disc(centre_, detail::circle_corners(centre_, axis_, detail::any_side(axis_), radius_),
                      triangles);
  }
  bool turns_in_itself(const Vec3& axis, const Vec3& point) const override {
    return detail::on_axis(axis, point, axis_, centre_);
  }
  SurfacePoint at(const Vec3& centre, std::int32_t) const override {
    const Vec3 d = centre - centre_;
    Vec3 radial = d - d.dot(axis_) * axis_;
    if (const double length = radial.norm(); length > radius_) radial *= radius_ / length;
    return detail::facing(centre, centre_ + radial, axis_);
  }

 private:
  Vec3 centre_, axis_;
  double radius_;
};

std::shared_ptr<const Surface> make_disc(const ShapeValues& values) {
  if (!(values.vector("axis").norm() > 0)) throw std::invalid_argument("axis must not be zero");
  return std::make_shared<Disc>(values.vector("centre"), values.vector("axis"), values.scalar("radius"));
}

constexpr ShapeParameter disc_parameters[] = {
    {"centre", "m", ShapeParameter::Kind::vector, "Centre."},
    {"axis", "", ShapeParameter::Kind::vector, "Direction at right angles to the disc, of any length."},
    {"radius", "m", ShapeParameter::Kind::length, "Radius."},
};

}  // namespace

extern const ShapeEntry disc_shape;
const ShapeEntry disc_shape = {"disc", "a round plate without thickness, touched from both sides",
                               disc_parameters, make_disc};

}  // namespace talus
