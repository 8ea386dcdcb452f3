#include "kernels/shapes/body_shapes.hpp"

namespace talus {

namespace {

Clump make_rod() {
  const Ball balls[] = {{{-2, 0, 0}, 1}, {{0, 0, 0}, 1}, {{2, 0, 0}, 1}};
  return make_clump(balls).clump;
}

}  // namespace

extern const BodyShapeEntry rod_body;
const BodyShapeEntry rod_body =
    named<BodyShape>("rod", "three equal balls in a row, each touching the next", make_rod);

}  // namespace talus
