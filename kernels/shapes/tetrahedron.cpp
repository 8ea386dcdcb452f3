#include "kernels/shapes/body_shapes.hpp"

namespace talus {

namespace {

/// Every other corner of a cube of side sqrt(2): 2 apart.
Clump make_tetrahedron() {
  constexpr double c = 0.70710678118654752;
  const Ball balls[] = {{{c, c, c}, 1}, {{c, -c, -c}, 1}, {{-c, c, -c}, 1}, {{-c, -c, c}, 1}};
  return make_clump(balls).clump;
}

}  // namespace

extern const BodyShapeEntry tetrahedron_body;
const BodyShapeEntry tetrahedron_body =
    named<BodyShape>("tetrahedron", "four equal balls, each touching all others", make_tetrahedron);

}  // namespace talus
