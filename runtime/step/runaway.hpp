#pragma once

/// Checks for steps after which the run cannot go on.

#include <stdexcept>

#include "runtime/step/step_report.hpp"

namespace talus {

/// The state blew up: NaN, or energy that no load supplied. The message has the step, the body and its state.
class RunawayError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Nothing is left for grains to be in: walls have passed one another, or a flow or a stress has squeezed a
/// periodic cell until a body could touch two images of another (check_cell). The end of what the scene can
/// show, in a step of which nothing is told, and no error of those before.
class NoSpaceError : public RunawayError {
 public:
  using RunawayError::RunawayError;
};

/// What no run that goes well reaches. Ratios have no unit.
struct RunawayThresholds {
  /// Two walls face each other where their unit normals add up to no more than this, > 0.
  double facing = 1e-12;
  /// Strain of a cell that follows a stress, in a step, > 0. Above what a scene may prescribe (a tenth,
  /// refused before the run), as a cell may swing beyond what it is asked for.
  double most_strain = 0.2;
  /// Kinetic energy over what loads and the motion before can give, > 1: errors within the tolerance add
  /// some.
  double most_energy = 100;
};

/// Area that the pressure on wall `w` acts on [m^2], in a stage that began with a box. Throws NoSpaceError
/// when there is no such area any more, because walls have run through one another.
double pressed_area(const StepState& state, std::size_t w, const StepName& step);

/// Throws RunawayError when the iterations diverge, the state is not finite, walls have passed one another,
/// or a step whose iterations did not converge has far more kinetic energy than was supplied. (Where they did
/// it has what its loads make: of a narrow wedge that a wall closes grains come far faster than the wall, and
/// at rest rounding of positions is all the motion there is.) `energy_free`: see free_energy_of [J].
void check_for_runaway(const StepOutcome& outcome, double energy_free,
                       const RunawayThresholds& thresholds = {});

/// Kinetic energy of pushed walls, and of a cell that follows a stress, with their free velocities, before a
/// step [J].
double free_energy_of(const StepState& state);

}  // namespace talus
