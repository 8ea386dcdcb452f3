#pragma once

#include "runtime/step/courses.hpp"
#include "runtime/step/error_history.hpp"
#include "runtime/step/setup.hpp"

namespace talus {

/// The fewest sweeps between two checks; a check costs about 1.5 sweeps. With several ranks the result of a
/// check is known only after the first sweep that follows it, and must take effect before the last one: hence
/// two.
inline constexpr int least_sweeps = 2;

/// Sweeps from the last check of the history to the next one, >= 0. It extrapolates the error as a power of
/// the number of sweeps, and checks where the tolerance would be met. Momentum behaves so in the beginning;
/// later the error falls exponentially, and the guess is slightly too short. The guess is at most half of the
/// sweeps done so far; with momentum it is at most as many as were done, and at most
/// MomentumParameters::trusted_sweeps. `start`: sweeps done when the trend began. The number is a multiple of
/// `exchange`, the sweeps per exchange, unless max_iterations cuts it.
int sweeps_until_check(const ErrorHistory& history, const Course& course, int start,
                       const SolverSettings& settings, int exchange);

}  // namespace talus
