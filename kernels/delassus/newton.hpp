#pragma once

/// Newton's method for contact problems given by W (kernels/delassus/delassus.hpp): for those that sweeps do
/// not solve, or not to many digits. Costs a factorisation a step, so for hundreds of contacts, not for
/// packings.

#include <memory>
#include <span>

#include "kernels/delassus/delassus.hpp"
#include "kernels/delassus/detail/block_factorisation.hpp"
#include "kernels/delassus/detail/own_error.hpp"

namespace talus {

struct NewtonSettings {
  double proximal = 1e-4;  ///< first weight of the proximal term, in units of trace(W_cc)/3; 1e-12 to 10
  int smoothing = 5;       ///< sweeps of the proximal problem after each step, >= 1
};

/// Proximal point around a semismooth Newton method. Outer: r_k+1 solves the law with u = W r + q + alpha D
/// (r - r_k), whose fixed points are those of the problem (Rockafellar 1976) and whose matrix is regular when
/// W, as usual, is not. Inner: Newton on the map of Alart and Curnier (1991),
///     F_N = r_N - max(0, z_N),   F_T = r_T - P(z_T, mu max(0, z_N)),   z = r - u,
/// in variables that make trace(W_cc)/3 = 1; open contacts drop out of the linear system (r = 0), which is
/// not symmetrised. A few sweeps of the proximal problem after each step repair the active set: without them
/// the line search creeps from one kink to the next. The step is halved twice over at most three times, on
/// |F| against the largest of the last three; then sweeps alone must do. alpha falls by 10 after an easy
/// proximal step and rises after a hard one. An iteration is one Newton step; the error is checked after
/// every one.
DelassusReport solve_newton(const DelassusProblem& problem, const DelassusGoal& goal,
                            const NewtonSettings& settings, std::span<double> r);

/// Whether every contact that approaches has a positive W_NN; counts the others. Newton's matrices have no
/// meaning without.
bool lawful(const DelassusProblem& problem, std::int64_t& failed_contacts);

/// Newton's method, to be paused between any two steps.
class NewtonIteration {
 public:
  /// `form` must outlive this. `r` is the start.
  NewtonIteration(const detail::FactorisedForm& form, const NewtonSettings& settings,
                  std::span<const double> r);
  ~NewtonIteration();
  /// One step; offers what it came to.
  void iterate(BestAnswer& answer);
  /// Goes on from r, with the first proximal weight.
  void begin_from(std::span<const double> r);
  const detail::OwnError& progress() const;
  detail::OwnError& progress();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace talus
