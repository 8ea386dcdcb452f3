#pragma once

/// Distances of a point from the shapes that walls may have, in the shape's first place, from their
/// definitions in docs/theory.md and docs/scenes.md.

#include <span>
#include <string_view>
#include <vector>

#include "apps/study_certificate/step_walls.hpp"

namespace talus::audit {

/// Whether the audit knows the shape of that name; "plane" is one.
bool knows_shape(std::string_view name);

/// Every point in which a sphere around `centre` touches the shape, at any distance; of a mesh those nearer
/// than `reach` [m] alone. `triangles`: of a mesh.
std::vector<WallTouch> touches_of(const WallShape& shape, std::span<const Triangle> triangles,
                                  const Vec3& centre, double reach);

}  // namespace talus::audit
