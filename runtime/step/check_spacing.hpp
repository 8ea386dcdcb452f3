#pragma once

#include "runtime/step/courses.hpp"
#include "runtime/step/error_history.hpp"
#include "runtime/step/setup.hpp"

namespace talus {

/// Sweeps between two checks at least: a check costs about 1.5 of them. Two, so that what several ranks learn
/// of a check behind the first sweep, and what it changes there, comes before the last one.
inline constexpr int least_sweeps = 2;

/// Sweeps from the last check of the history to the next one, >= 0: to where the tolerance will be met if the
/// error goes on as a power of the sweeps done, which is what momentum does in the beginning, and later errs
/// to the short side of what exponentials need by little. A wrong guess costs no more than half of what was
/// done; with momentum as much again, but few. `start`: sweeps done when those that count began. A multiple
/// of `exchange`, sweeps per exchange, but where max_iterations ends it.
int sweeps_until_check(const ErrorHistory& history, const Course& course, int start,
                       const SolverSettings& settings, int exchange);

}  // namespace talus
