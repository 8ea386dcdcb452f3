#pragma once

/// Candidates of clumps. The broad phase finds pairs of bodies, by the spheres around them; each ball of one
/// body may then touch each ball of the other.

#include "kernels/detection/chunks.hpp"
#include "kernels/shapes/clump.hpp"

namespace talus {

/// Replaces each candidate of two bodies, or of a body and a feature of a wall, by candidates of two balls,
/// or of a ball and a feature (touch_wall), and fills Candidates::balls; `impulse` must be empty yet. Does
/// nothing if no body is a clump.
void split_into_balls(const ClumpView& clumps, Candidates& candidates);

/// Gives chunks with a clump among their bodies the kind of blocks.
void note_kinds(const ClumpView& clumps, Chunks& chunks);

}  // namespace talus
