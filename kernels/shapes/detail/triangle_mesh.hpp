#pragma once

#include <memory>
#include <vector>

#include "kernels/shapes/shape.hpp"

namespace talus::detail {

/// The closed surface of a solid made of triangles (feature k: triangle k), whose normals point out of it;
/// or, with `inside`, of a space that the grains fill, the solid around it.
///
/// A sphere touches where its distance from the surface is smallest nearby: the nearest point of a triangle
/// counts unless it belongs to another triangle, too, that comes nearer to the centre. So a sphere above one
/// of two triangles in a plane does not touch the edge between them, a sphere before an outward edge or
/// corner touches it once, and a sphere in an inward edge touches the two faces and not the edge. Of points
/// that coincide the triangle of the lowest number keeps one. That is decided by places, not by names of
/// edges, so that a corner of one triangle may stand in the middle of another's edge. What a sphere touches
/// from behind does not count: a wall may be thinner than a grain. So a sphere deep in the solid touches
/// nothing, and only depth() tells that it is there.
///
/// Candidates come from a uniform grid over the triangles, with about as many cells as these.
///
/// Throws std::invalid_argument naming the triangle, counted from 1, when there is none, a corner is not
/// finite, a triangle has no area, an edge has no partner or one of the same direction (the triangles there
/// face opposite ways), or when the triangles face into the solid.
std::shared_ptr<const Surface> make_mesh(std::vector<Triangle> triangles, bool inside);

/// Nearest point of a triangle to p (Ericson, Real-Time Collision Detection, 2005, section 5.1.5).
Vec3 nearest_point(const Triangle& triangle, const Vec3& p);

}  // namespace talus::detail
