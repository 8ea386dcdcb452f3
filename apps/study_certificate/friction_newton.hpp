#pragma once

/// A semismooth Newton method for one step with friction (Alart and Curnier 1991).

#include <Eigen/SparseCore>

#include <memory>
#include <span>
#include <vector>

#include "apps/study_certificate/step_problem.hpp"

namespace talus::audit {

/// In coordinates s = r / scale, with scale W_nn^-1/2 along the normal and W_tt^-1/2 across it, the law of
/// all contacts is F(s) = s - P(s - (W s + q)) = 0, P the projection on r_n >= 0 and then on Coulomb's disc,
/// and W has ones on its diagonal. A step solves (1 - P' + P' (W + shift)) ds = -F: the shift keeps redundant
/// contacts where they are, and slows down what belongs to an eigenvalue l of W to a factor shift/(shift +
/// l).
class FrictionNewton {
 public:
  explicit FrictionNewton(const StepProblem& problem);

  /// Steps from r as long as each makes the residual smaller; r in and out. Returns the residual: largest
  /// entry of F over the largest of s and of the closing speeds. `moved`: the step that would be made next,
  /// relative to the largest entry of s: about the error of s where the residual is rounding; 1 where the
  /// system has no solution.
  double improve(std::vector<Vec3>& r, int most_steps, double& moved) const;

 private:
  using Matrix = Eigen::SparseMatrix<double>;
  using Vector = Eigen::VectorXd;

  Vector scaled(std::span<const Vec3> r) const;
  std::vector<Vec3> unscaled(const Vector& s) const;
  Vector law(const Vector& s) const;  ///< F
  double residual(const Vector& s, const Vector& F) const;
  bool step(const Vector& s, const Vector& F, double shift, Vector& ds) const;
  void derivative(const Vector& z, std::size_t c, Eigen::Matrix3d& D) const;

  std::vector<Eigen::Matrix3d> frame_;  ///< columns normal and two tangents, of each contact
  std::vector<double> friction_;        ///< in scaled coordinates
  Vector scale_, q_;                    ///< 3 per contact
  Matrix W_;
};

}  // namespace talus::audit
