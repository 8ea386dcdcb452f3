#pragma once

#include <span>

#include "kernels/delassus/delassus.hpp"

namespace talus {

/// How solve_auto shares its work among its methods.
struct AutoSettings {
  double patience = 2;
  double most = 1, most_foretold = 2, most_stalled = 4, least = 0.1;
  double stall = 0.4, stall_sweeps = 0.7;
  double newton_steps = 8, admm_steps = 60;
  double better = 0.3;
  double slice = 0.05;
  double pessimism = 2;
};

DelassusReport solve_auto(const DelassusProblem& problem, const DelassusGoal& goal, const AutoSettings& settings,
                          std::span<double> r);

}  // namespace talus
