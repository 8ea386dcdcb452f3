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
  automatic,      ///< sweeps with momentum, and Newton when its time has come
};

inline constexpr std::array<DelassusMethod, 6> all_delassus_methods = {
    DelassusMethod::nlgs, DelassusMethod::nlgs_momentum, DelassusMethod::nncg,
    DelassusMethod::admm, DelassusMethod::newton,        DelassusMethod::automatic};

/// nlgs, nlgs+momentum, nncg, admm, newton, auto.
std::string_view name_of(DelassusMethod method);
std::optional<DelassusMethod> delassus_method(std::string_view name);

/// Solves from `r` (3 values per contact) on, and leaves the answer of least error there. Same input, same
/// bits (but for where goal.stop ends it): `automatic` decides by errors and by counted work, not by clocks.
/// It sweeps with momentum; when the sweeps have cost four steps of Newton, and then whenever their number
/// has doubled, it tries Newton from the best r, for at most half of what the sweeps have cost, and gives it
/// up after two steps that do not help: once the sweeps have found which contacts are open, stick and slide,
/// one or two such steps reach any tolerance. When the sweeps have not made the error a third since the last
/// trial, they have stalled, and Newton is given up after six.
DelassusReport solve_delassus(const DelassusProblem& problem, DelassusMethod method, const DelassusGoal& goal,
                              std::span<double> r);

}  // namespace talus
