#include "kernels/shapes/detail/triangle_mesh.hpp"
#include "kernels/shapes/shape.hpp"

namespace talus {

namespace {

std::shared_ptr<const Surface> make_mesh(const ShapeValues& values) {
  return detail::make_mesh(values.triangles, values.truth("inside"));
}

constexpr ShapeParameter mesh_parameters[] = {
    {"file", "", ShapeParameter::Kind::file,
     "STL file of triangles [m], binary or text; a relative path begins at the folder of the scene."},
    {"inside", "", ShapeParameter::Kind::truth, "The grains are inside; else they are outside of a solid."},
};

}  // namespace

extern const ShapeEntry mesh_shape;
const ShapeEntry mesh_shape = {
    "mesh", "the closed surface of a solid, or of the space of the grains, made of triangles",
    mesh_parameters, make_mesh};

}  // namespace talus
