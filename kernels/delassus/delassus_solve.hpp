#pragma once

/// The one entry to all solvers of contact problems given by W.

#include <array>
#include <optional>
#include <span>
#include <string_view>

#include "kernels/delassus/delassus.hpp"

namespace talus {

enum class DelassusMethod {
  nlgs,           ///< damped sweeps
  nlgs_momentum,  ///< damped sweeps with Nesterov's momentum
  nncg,           ///< nonsmooth nonlinear conjugate gradients on the sweep
  admm,           ///< ADMM with W + rho I factorised
  newton,         ///< proximal point around semismooth Newton
  automatic,      ///< these methods in turn (delassus_auto.hpp)
};

inline constexpr std::array<DelassusMethod, 6> all_delassus_methods = {
    DelassusMethod::nlgs, DelassusMethod::nlgs_momentum, DelassusMethod::nncg,
    DelassusMethod::admm, DelassusMethod::newton,        DelassusMethod::automatic};

/// nlgs, nlgs+momentum, nncg, admm, newton, auto.
std::string_view name_of(DelassusMethod method);
std::optional<DelassusMethod> delassus_method(std::string_view name);

/// Solves from `r` (3 values per contact) on, and leaves the answer of least error there. Same input, same
/// bits, but for where goal.stop ends it.
DelassusReport solve_delassus(const DelassusProblem& problem, DelassusMethod method, const DelassusGoal& goal,
                              std::span<double> r);

}  // namespace talus
