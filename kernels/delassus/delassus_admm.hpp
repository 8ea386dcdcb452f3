#pragma once

#include <span>

#include "kernels/delassus/delassus.hpp"
#include "kernels/delassus/detail/block_factorisation.hpp"
#include "kernels/delassus/detail/own_error.hpp"

namespace talus {

struct AdmmSettings {
  double penalty = 0.1;          ///< first rho, in units of trace(W_cc)/3, > 0; adapted on the way
  double over_relaxation = 1.6;  ///< 1 to 1.9
};

/// Alternating direction method of multipliers on the stored W (Boyd et al. 2011; for friction Acary, Bremond
/// and Huber 2018), in variables that make trace(W_cc)/3 = 1:
///     (W + rho I) r = rho z - lambda - q - mu |lambda_T| n,   z = P_K(r^ + lambda/rho),   lambda += rho (r^
///     - z)
/// with r^ = 1.6 r - 0.6 z; lambda -> -(u + mu |u_T| n), so the De Saxce term lags one iteration. W + rho I
/// is factorised once, and again when rho must change: by LDL' when W is symmetric to rounding, by LU when
/// not. Sees through long chains, which sweeps do not; many cheap iterations where Newton has few dear ones.
DelassusReport solve_admm(const DelassusProblem& problem, const DelassusGoal& goal,
                          const AdmmSettings& settings, std::span<double> r);

/// What an iteration costs without factorisation, in multiplications, as far as it is known before the first.
double admm_cost(const DelassusProblem& problem);

namespace detail {

/// W + rho I, factorised.
class ShiftedMatrix {
 public:
  /// `order`: of elimination. The problem must outlive this.
  ShiftedMatrix(const DelassusProblem& problem, std::span<const std::int32_t> order);
  /// False when the matrix is singular.
  bool factorise(double rho);
  void solve(const Eigen::VectorXd& rhs, Eigen::VectorXd& x);
  /// In multiplications.
  double solve_cost() const { return factors_.solve_cost() + 60.0 * static_cast<double>(p_.contacts()); }

 private:
  const DelassusProblem& p_;
  std::vector<std::int32_t> place_;
  bool definite_;
  BlockFactorisation factors_;
  Eigen::VectorXd work_;
};

}  // namespace detail

/// ADMM, to be paused between any two iterations.
class AdmmIteration {
 public:
  /// `form` must outlive this. `r` is the start.
  AdmmIteration(const detail::FactorisedForm& form, const AdmmSettings& settings, std::span<const double> r);
  /// One iteration; offers what it came to when a check is due or the solve ends.
  void iterate(BestAnswer& answer);
  /// Goes on from r with the multipliers that its velocities give.
  void begin_from(std::span<const double> r);
  /// False when W + rho I is singular: no iteration does anything any more.
  bool regular() const { return regular_; }
  const detail::OwnError& progress() const { return progress_; }
  detail::OwnError& progress() { return progress_; }

 private:
  void factorise(BestAnswer& answer);
  /// Residual balancing (Boyd et al. 2011, 3.4.1), ever more seldom, so that the method still converges.
  void balance(BestAnswer& answer);

  const detail::FactorisedForm& form_;
  AdmmSettings settings_;
  detail::ShiftedMatrix matrix_;
  Eigen::VectorXd z_, lambda_, x_, rhs_, relaxed_, old_;
  std::vector<double> candidate_;
  double rho_;
  bool regular_ = true;
  detail::OwnError progress_;
  std::int64_t iterations_ = 0, next_check_ = 1, next_change_ = 20;
};

}  // namespace talus
