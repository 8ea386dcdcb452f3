#include "kernels/shapes/body_shapes.hpp"

namespace talus {

namespace {

Clump make_dumbbell() {
  const Ball balls[] = {{{-1, 0, 0}, 1}, {{1, 0, 0}, 1}};
  return make_clump(balls).clump;
}

}  // namespace

extern const BodyShapeEntry dumbbell_body;
const BodyShapeEntry dumbbell_body =
    named<BodyShape>("dumbbell", "two equal balls that touch", make_dumbbell);

}  // namespace talus
