#pragma once

/// How fast candidates close: what a time step is chosen by (runtime/step/time_step.hpp).

#include "kernels/bodies/bodies.hpp"
#include "kernels/detection/chunks.hpp"
#include "kernels/detection/measures.hpp"

namespace talus {

/// The largest of speed of approach over max(gap, `near`) [1/s], over the candidates with the present poses
/// and velocities; 0 where none approaches. In a time step of its inverse no pair comes nearer by more than
/// its gap and, once that is below `near` > 0 [m], by more than `near`. The speed is that of the centres
/// along the normal, plus the speeds |w| of clumps, which may turn a corner towards one another. At a surface
/// that is no plane it is the speed of the centre in any direction, since motion along a hollow surface leads
/// into it. The maximum is over single pairs, hence the same in any order.
double closing_rate(const Candidates& candidates, const Bodies& bodies, const Poses& poses, double near);

}  // namespace talus
