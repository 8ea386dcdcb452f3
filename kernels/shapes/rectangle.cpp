#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "kernels/shapes/detail/plate.hpp"
#include "kernels/shapes/shape.hpp"

namespace talus {

namespace {

/// A rectangle without thickness, touched from both sides and at its rim.
class Rectangle final : public Surface {
 public:
  Rectangle(const Vec3& corner, const Vec3& a, const Vec3& b)
      : corner_(corner), length_{a.norm(), b.norm()}, along_{a / length_[0], b / length_[1]} {}

  Bounds bounds() const override {
    Bounds box{corner_, corner_};
    for (const double i : {0.0, length_[0]})
      for (const double j : {0.0, length_[1]}) {
        const Vec3 corner = corner_ + i * along_[0] + j * along_[1];
        box = {box.low.cwiseMin(corner), box.high.cwiseMax(corner)};
      }
    return box;
  }
  void show(std::vector<Triangle>& triangles) const override {
    const Vec3 a = length_[0] * along_[0], b = length_[1] * along_[1];
    triangles.push_back({corner_, corner_ + a, corner_ + a + b});
    triangles.push_back({corner_, corner_ + a + b, corner_ + b});
  }
  SurfacePoint at(const Vec3& centre, std::int32_t) const override {
    const Vec3 d = centre - corner_;
    const double i = std::clamp(d.dot(along_[0]), 0.0, length_[0]);
    const double j = std::clamp(d.dot(along_[1]), 0.0, length_[1]);
    return detail::facing(centre, corner_ + i * along_[0] + j * along_[1], along_[0].cross(along_[1]));
  }

 private:
  Vec3 corner_;
  double length_[2];  ///< of the edges [m]
  Vec3 along_[2];     ///< unit
};

std::shared_ptr<const Surface> make_rectangle(const ShapeValues& values) {
  const Vec3 a = values.vector("edge_a"), b = values.vector("edge_b");
  if (!(a.norm() > 0)) throw std::invalid_argument("edge_a must not be zero");
  if (!(b.norm() > 0)) throw std::invalid_argument("edge_b must not be zero");
  if (std::abs(a.dot(b)) > 1e-9 * a.norm() * b.norm())
    throw std::invalid_argument("edge_a and edge_b must be at right angles");
  return std::make_shared<Rectangle>(values.vector("corner"), a, b);
}

constexpr ShapeParameter rectangle_parameters[] = {
    {"corner", "m", ShapeParameter::Kind::vector, "A corner of the rectangle."},
    {"edge_a", "m", ShapeParameter::Kind::vector, "Edge of the rectangle that begins at `corner`."},
    {"edge_b", "m", ShapeParameter::Kind::vector, "The other edge there, at right angles to `edge_a`."},
};

}  // namespace

extern const ShapeEntry rectangle_shape;
const ShapeEntry rectangle_shape = {"rectangle", "a plate without thickness, touched from both sides",
                                    rectangle_parameters, make_rectangle};

}  // namespace talus
