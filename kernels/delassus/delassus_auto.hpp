#pragma once

#include <span>

#include "kernels/delassus/delassus.hpp"

namespace talus {

/// How solve_auto shares its work. Found by racing it against the single methods
/// (docs/decisions/0022-auto-solve.md).
struct AutoSettings {
  /// Most work of all other methods together, of what the sweeps with momentum have had: where the others are
  /// expected to be through sooner; where that follows from how their error falls; where the sweeps stand
  /// still; and in any case.
  double others = 1, others_falling = 1.5, others_instead = 1.2, others_always = 0.1;
  /// A method stands still when it has found its least error before this last part of its work; the sweeps go
  /// over to a better r of another method only after the second part.
  double still = 0.4, still_sweeps = 0.7;
  double patience = 3;  ///< one that stands still is expected to need so many times what it has had
  double better = 0.3;  ///< what stands still goes over to an r whose error is less than this part of its own
  double newton_steps = 4;   ///< that Newton is expected to need before anything is known
  double admm_decade = 25;   ///< iterations of ADMM for a digit, likewise
  double sweeps_first = 30;  ///< sweeps before anything is said of them
  double slice = 0.05;       ///< work of a slice, of what the sweeps with momentum have had
};

/// Sweeps with momentum, conjugate sweeps, Newton and ADMM in turn, each going on where its own last slice
/// ended, until one of them reaches the goal. Sweeps with momentum are never denied two fifths of the work
/// for long, because they are the best method of most problems; the rest goes to the method that is expected
/// to be through soonest: by how its own error has fallen, or, before that is known, by what such a method
/// usually takes. The others begin where the best answer is. One that stands still loses its slices to the
/// others, but none is given up while the goal lets the solve go on. All is decided by errors and counted
/// multiplications: the same input gives the same bits, but for where goal.stop ends it.
DelassusReport solve_auto(const DelassusProblem& problem, const DelassusGoal& goal,
                          const AutoSettings& settings, std::span<double> r);

}  // namespace talus
