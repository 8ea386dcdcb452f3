#include <stdexcept>

#include "kernels/shapes/detail/revolution.hpp"
#include "kernels/shapes/shape.hpp"

namespace talus {

namespace {

std::shared_ptr<const Surface> make_cone(const ShapeValues& values) {
  const double radius[2] = {values.scalar("start_radius"), values.scalar("end_radius")};
  if (!(radius[0] + radius[1] > 0))
    throw std::invalid_argument("start_radius and end_radius must not both be 0");
  return detail::make_frustum(
      {{values.vector("start"), values.vector("end")}, {radius[0], radius[1]}, values.truth("inside")});
}

constexpr ShapeParameter cone_parameters[] = {
    {"start", "m", ShapeParameter::Kind::vector, "Centre of the first end."},
    {"end", "m", ShapeParameter::Kind::vector, "Centre of the other end."},
    {"start_radius", "m", ShapeParameter::Kind::extent, "Radius at `start`; 0 for a tip."},
    {"end_radius", "m", ShapeParameter::Kind::extent, "Radius at `end`; 0 for a tip."},
    {"inside", "", ShapeParameter::Kind::truth, "The grains are inside; else they are outside of a solid."},
};

}  // namespace

extern const ShapeEntry cone_shape;
const ShapeEntry cone_shape = {"cone",
                               "with `inside` a funnel without thickness, open at its ends; else a solid",
                               cone_parameters, make_cone};

}  // namespace talus
