#pragma once

/// Candidates of clumps: the broad phase finds pairs of bodies, by the spheres that hold them, and each ball
/// of the one may touch each ball of the other.

#include "kernels/detection/chunks.hpp"
#include "kernels/shapes/clump.hpp"

namespace talus {

/// From one candidate per pair of bodies, or of a body and a feature of a wall, to one per pair of balls, or
/// of a ball and a feature (touch_wall), and Candidates::balls; `impulse` must be empty yet. Nothing happens
/// where no body is a clump.
void split_into_balls(const ClumpView& clumps, Candidates& candidates);

/// Chunks with a clump among their bodies become those of blocks.
void note_kinds(const ClumpView& clumps, Chunks& chunks);

}  // namespace talus
