#pragma once

/// Solvers of contact problems given by W that go from contact to contact (kernels/delassus/delassus.hpp).

#include <cstddef>
#include <span>

#include "kernels/delassus/delassus.hpp"
#include "kernels/delassus/detail/own_error.hpp"

namespace talus {

/// Sweeps of the proximal problem u = W r + q + hold (r - centre): for solvers that want a smoother.
class ProximalSweep {
 public:
  /// The plain sweep: hold 0. The problem must outlive this.
  explicit ProximalSweep(const DelassusProblem& problem) : problem_(&problem) {}
  /// `hold` [1/kg] per contact, >= 0.
  ProximalSweep(const DelassusProblem& problem, std::span<const double> hold);
  /// One sweep over r. `centre` may be r: a contact is then held to its impulse before the sweep.
  /// Returns the number of contacts whose law had no solution.
  std::int64_t operator()(std::span<const double> centre, std::span<double> r) const;

 private:
  const DelassusProblem* problem_;
  std::vector<LocalBlock> block_;  ///< W_cc + hold I; empty: the problem's own
  std::vector<double> hold_;       ///< empty: 0
};

struct SweepSettings {
  double damping = 0.03;  ///< 0 to 1: part of trace(W_cc)/3 that holds a contact to its last impulse; 0: none
  double momentum = 1;    ///< 0 to 1: upper limit of the momentum factor; 0: none
};

/// Nonlinear Gauss-Seidel: contact by contact, the exact local law with the newest impulses of all others
/// (Jean and Moreau 1992). `r` (3 values per contact) is the start and takes the result. Three things are
/// added to the textbook's sweep:
///  - damping: from the second sweep on, the law is solved with W_cc + damping D_c I and q less damping D_c
///    r_c(old), D_c = trace(W_cc)/3: a proximal step, whose fixed points are the same. Without it NLGS (and
///    Siconos' NSGS) runs in circles on FCLIB's OneObject-i100000-316, where W is singular and unsymmetric.
///    On the development set 0.01 to 0.1 serve alike.
///  - momentum: a sweep starts from r_k + beta_k (r_k - r_k-1), beta_k Nesterov's, begun anew when the step
///    turns back (O'Donoghue and Candes 2015) or grows by more than sqrt(2), in the norm with the weights
///    D_c. Where a plain sweep needs hundreds of iterations, 3 to 50 times fewer.
///  - rescue: without a better r for as many sweeps as the best one took (at least 1000), back to it, with a
///    momentum limit of 0.9, then 0, then again that of the settings.
/// The error is computed afresh at sweeps 1, 2, 3, ... and then at intervals of a tenth of the sweeps done,
/// up to 50. Same input, same bits (but for where `stop` ends it).
DelassusReport solve_nlgs(const DelassusProblem& problem, const DelassusGoal& goal,
                          const SweepSettings& settings, std::span<double> r);

/// Nonsmooth nonlinear conjugate gradients (Silcowitz-Hansen, Niebe and Erleben 2010): a sweep r -> G(r)
/// gives the gradient g = r - G(r) in the norm with the weights D_c; Fletcher-Reeves directions, begun anew
/// when |g| grows. Checks as solve_nlgs.
DelassusReport solve_nncg(const DelassusProblem& problem, const DelassusGoal& goal, double damping,
                          std::span<double> r);

/// The sweeps of one solve, to be paused between any two: what `automatic` does with several methods in turn.
class SweepIteration {
 public:
  /// How the next sweep begins.
  enum class Start { momentum, conjugate };
  /// The problem must outlive this. `r` is the start.
  SweepIteration(const DelassusProblem& problem, Start start, const SweepSettings& settings,
                 std::span<const double> r);
  /// One sweep; offers what it came to when a check is due or the solve ends.
  void iterate(BestAnswer& answer);
  /// Goes on from r, without memory of what was before.
  void begin_from(std::span<const double> r);
  const detail::OwnError& progress() const { return progress_; }
  detail::OwnError& progress() { return progress_; }

 private:
  void advance();
  void advance_conjugate();
  void rescue(BestAnswer& answer);

  const DelassusProblem& problem_;
  Start kind_;
  SweepSettings settings_;
  std::vector<double> weight_;  ///< D_c
  ProximalSweep sweep_;
  std::vector<double> r_, start_, previous_;  ///< result, start of the next sweep; result before or direction
  detail::OwnError progress_;
  std::int64_t sweeps_ = 0, next_check_ = 1, best_sweep_ = 0, rescued_ = 0;
  double limit_ = 1, t_ = 1, last_step_;  ///< of momentum; last squared step, weighted with D_c
};

/// What a sweep costs, and the check of an error, in multiplications; of a problem of so many contacts and
/// blocks off the diagonal.
double sweep_cost(std::size_t blocks, std::size_t contacts);
double sweep_cost(const DelassusProblem& problem);
double check_cost(const DelassusProblem& problem);

}  // namespace talus
