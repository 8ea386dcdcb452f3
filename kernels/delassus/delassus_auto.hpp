#pragma once

#include <span>

#include "kernels/delassus/delassus.hpp"

namespace talus {

/// How solve_auto shares its work among its methods.
struct AutoSettings {
  double patience = 4;    ///< a method that stands still is expected to need so many times what it has spent
  double share = 1.0 / 16;  ///< least work of a method, of that of the one that has most
  double better = 0.3;    ///< a method goes over to the best r of all when that has less than this part of its error
  double slice = 0.1;     ///< a method's turn, of the work that it has had
};

DelassusReport solve_auto(const DelassusProblem& problem, const DelassusGoal& goal, const AutoSettings& settings,
                          std::span<double> r);

}  // namespace talus
