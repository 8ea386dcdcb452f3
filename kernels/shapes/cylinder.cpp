#include "kernels/shapes/detail/revolution.hpp"
#include "kernels/shapes/shape.hpp"

namespace talus {

namespace {

std::shared_ptr<const Surface> make_cylinder(const ShapeValues& values) {
  const double radius = values.scalar("radius");
  return detail::make_frustum(
      {{values.vector("start"), values.vector("end")}, {radius, radius}, values.truth("inside")});
}

constexpr ShapeParameter cylinder_parameters[] = {
    {"start", "m", ShapeParameter::Kind::vector, "Centre of the first end."},
    {"end", "m", ShapeParameter::Kind::vector, "Centre of the other end."},
    {"radius", "m", ShapeParameter::Kind::length, "Radius."},
    {"inside", "", ShapeParameter::Kind::truth, "The grains are inside; else they are outside of a solid."},
};

}  // namespace

extern const ShapeEntry cylinder_shape;
const ShapeEntry cylinder_shape = {
    "cylinder", "with `inside` a tube without thickness, open at its ends; else a solid rod",
    cylinder_parameters, make_cylinder};

}  // namespace talus
