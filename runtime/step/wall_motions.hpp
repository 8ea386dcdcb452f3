#pragma once

/// Walls with a prescribed motion (kernels/shapes/prescribed_motion.hpp) during a step, and walls that come
/// and go with stages.
///
/// Contacts of a step keep the gaps of its middle from closing until the middle of the next one. So the
/// velocity of a wall in a step is the one that brings it from its place in the middle of this step to that
/// in the middle of the next. Laws of restitution take the same velocity as the one before an impact.

#include <span>
#include <string>

#include "runtime/graph/communicator.hpp"
#include "runtime/step/setup.hpp"
#include "runtime/step/state.hpp"

namespace talus {

/// Before the first step: chooses the point about which each wall's torque is reported, where the setup gives
/// none. A surface of revolution that turns about its own axis becomes one at rest whose material moves.
void simplify_motions(std::span<Wall> walls);

/// When motions begin and end, and which walls are absent, as the stage with number `stage` begins.
/// `stage_begins`: times of the run at which it and the stages before it have begun [s].
void resolve_stages(const Setup& setup, std::size_t stage, std::span<const double> stage_begins,
                    std::span<Wall> walls);

/// Brings walls to where they are at `time` [s], with the velocities of a step of length `h` from there on.
void set_walls(const Setup& setup, double time, double h, StepState& state);

/// Throws RunawayError, in which `step` is named, when the table of a motion ends before the step does.
void demand_motion(double time, double h, const std::string& step, std::span<const Wall> walls);

/// Finds the velocities of the walls in the step of length h [s] from `time` on, how far they have come since
/// the middle of the step before, of length `before` [s], and where they are in the middle and at the end of
/// this one. Collective where a plane turns.
void prepare_walls(double time, double h, double before, StepState& state, const graph::Communicator& ranks);

/// Bound on how much nearer to any grain a wall's surface has come since the time `then` [m]. `first`: the
/// wall in its first place.
double way_since(const Wall& first, const Wall& wall, const WallState& state, double then);

/// The point about which a wall's torque is reported, with the wall at `pose` if its motion is prescribed.
Vec3 own_point(const Wall& first, const Wall& wall, const Pose& pose);

/// The same of a group, in the middle of the last step. `state`: that of the first of its walls.
Vec3 point_of_group(const WallGroup& group, const WallState& state);

}  // namespace talus
