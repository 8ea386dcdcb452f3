#pragma once

/// Distances of a point from the shapes that walls may have, in the shape's first place, from their
/// definitions in docs/theory.md and docs/scenes.md.

#include <span>
#include <vector>

#include "apps/study_certificate/step_walls.hpp"

namespace talus::audit {

/// Every point in which a sphere around `centre` touches the shape, at any distance; of a mesh those nearer
/// than `reach` [m] alone. `triangles`: of a mesh.
std::vector<Touch> touches_of(const WallShape& shape, std::span<const Triangle> triangles, const Vec3& centre,
                              double reach);

}  // namespace talus::audit
