#include <algorithm>
#include <stdexcept>

#include "kernels/bodies/farthest.hpp"
#include "kernels/shapes/shape.hpp"

namespace talus {

extern const ShapeEntry rectangle_shape, disc_shape, cylinder_shape, cone_shape, mesh_shape;

namespace {
/// A shape is picked by its row; its column is the sphere: clumps touch by their balls.
constexpr const ShapeEntry* table[] = {
    &rectangle_shape, &disc_shape, &cylinder_shape, &cone_shape, &mesh_shape,
};
}  // namespace

std::span<const ShapeEntry* const> wall_shapes() {
  return table;
}

const ShapeEntry* wall_shape(const std::string& name) {
  for (const ShapeEntry* shape : table)
    if (name == shape->name) return shape;
  return nullptr;
}

void make_surface(WallShape& shape) {
  const ShapeEntry* entry = wall_shape(shape.name);
  if (entry == nullptr) return;
  for (const ShapeParameter& parameter : entry->parameters)
    if (const auto found = shape.values.number.find(parameter.name);
        found != shape.values.number.end() && !std::ranges::all_of(found->second, within_farthest))
      throw std::invalid_argument(parameter.name + std::string(" must be within 1e15 ") + parameter.unit);
  for (const Triangle& triangle : shape.values.triangles)
    for (const Vec3& corner : triangle)
      if (!within_farthest(corner.cwiseAbs().maxCoeff()))
        throw std::invalid_argument("corners of the mesh must be within 1e15 m");
  shape.surface = entry->make(shape.values);
  shape.values.triangles = {};
}

}  // namespace talus
