#include "kernels/shapes/body_shapes.hpp"

namespace talus {

extern const BodyShapeEntry dumbbell_body, rod_body, tetrahedron_body;

const Registry<BodyShape, ClumpMaker>& body_shapes() {
  static const BodyShapeEntry entries[] = {
      {BodyShape::sphere, "sphere", "a ball"},
      dumbbell_body,
      rod_body,
      tetrahedron_body,
  };
  static const Registry<BodyShape, ClumpMaker> registry("body shape", entries);
  return registry;
}

}  // namespace talus
