#pragma once

/// Where a sphere meets a wall that bends under its way: the rim of a plate, an edge of a mesh, the outside
/// of a cylinder. The law of a step is linear about one normal (docs/theory.md, "Gap term and restitution").

#include "kernels/shapes/walls.hpp"

namespace talus::detail {

/// Beside PathThresholds, of walls.
struct WallPathThresholds {
  double still = 1e-6;  ///< a wall is flat where its normal turns by less than this while an edge's would by
                        ///< PathThresholds::flat, > 0
  int halvings = 40;    ///< of a way, to find a place on it, >= 1
  int features = 8;     ///< that follow one another on a way, at most, >= 1
};

/// How a sphere goes against a wall from the middle of a step to that of the next, unless something stops it
/// [m].
struct PathOfStep {
  Vec3 way;         ///< as it comes into the step
  Vec3 loaded;      ///< and with what loads do meanwhile
  double held = 0;  ///< up to this gap cohesion holds it: no path is asked for
};

/// The point by which a step is to judge a sphere that has the centre `centre` in the middle of the step and
/// `point` before it there. Where it nears, that closes the gap and the wall bends, it is at an edge the
/// point in which the sphere first touches it on `way`, a straight line, or comes nearest to it if it passes;
/// with a distance such that gap and way along the normal there give the gap at the end of the way, and so
/// does what loads add where it passes, as others may carry it. Of what bends about more than the sphere's
/// distance, and of a face before which the sphere is now, the normal stays, and so does the distance unless
/// the sphere passes. A sphere that passes over the rim of a plate is not stopped by it, however the rim
/// leans as seen from afar. Hollow walls, and all else: `point`.
SurfacePoint touch_on_path(const Wall& wall, const Vec3& centre, double radius, const PathOfStep& path,
                           const SurfacePoint& point);

}  // namespace talus::detail
