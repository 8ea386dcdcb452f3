#pragma once

#include "runtime/step/courses.hpp"
#include "runtime/step/error_history.hpp"
#include "runtime/step/setup.hpp"

namespace talus {

/// The fewest sweeps between two checks; a check costs about 1.5 sweeps. Two, because several ranks learn the
/// result of a check only after the first sweep behind it: what it changes must come before the last one.
inline constexpr int least_sweeps = 2;

/// Sweeps from the last check of the history to the next one, >= 0. It extrapolates the error as a power of
/// the number of sweeps, and checks where the tolerance would be met. Momentum behaves so in the beginning;
/// later the error falls exponentially, and the guess is slightly too short. A guess is at most half of the
/// sweeps done so far; with momentum at most as many again, and no more than
/// MomentumParameters::trusted_sweeps. `start`: sweeps done when the trend began. The number is a multiple of
/// `exchange`, the sweeps per exchange, unless max_iterations cuts it.
int sweeps_until_check(const ErrorHistory& history, const Course& course, int start,
                       const SolverSettings& settings, int exchange);

}  // namespace talus
