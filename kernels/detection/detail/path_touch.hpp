#pragma once

/// Where a sphere meets a wall that bends under its way: the rim of a plate, an edge of a mesh, the outside
/// of a cylinder. The law of a step is linear about one normal (docs/theory.md, "Gap term and restitution").

#include "kernels/shapes/walls.hpp"

namespace talus::detail {

/// The point by which a step is to judge a sphere that has the centre `centre` in the middle of the step and
/// `point` before it there, and moves by `way` [m] against the wall until the middle of the next step, or
/// with what loads do meanwhile by `loaded`. Where it nears and that closes the gap, and the wall bends, it
/// is the one in which the sphere first touches the wall there on `way`, a straight line, or comes nearest to
/// it if it passes; with a distance such that gap and way along the normal there give the gap at the end of
/// the way, and so does what loads add where it passes, as others may carry it. A sphere that passes over the
/// rim of a plate is not stopped by it, however the rim leans as seen from afar. Else `point`.
SurfacePoint touch_on_path(const Wall& wall, const Vec3& centre, double radius, const Vec3& way,
                           const Vec3& loaded, const SurfacePoint& point);

}  // namespace talus::detail
