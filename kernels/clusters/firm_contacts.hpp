#pragma once

/// The linear system of a cluster whose contacts are springs, so firm that next to nothing gives way.

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <span>
#include <vector>

#include "kernels/global/body_problem.hpp"

namespace talus {

/// A = M + H rho H^T over the freedoms of the bodies (3 of a grain, 6 where it turns, 1 of a wall),
/// factorised directly. rho is `firmness` effective masses of each contact; H is that of the normals, with mu
/// > 0 of all directions.
class FirmContacts {
 public:
  /// Costs a sparse Cholesky factorisation.
  FirmContacts(const BodyProblem& problem, double firmness);

  double rho(std::size_t contact) const { return rho_[contact]; }  ///< [kg]

  struct Solution {
    std::vector<Twist> motion;  ///< per unknown [m/s]
    std::vector<Twist> last;    ///< by which the last refinement has changed it: about its error
  };
  /// A motion = force [N s], refined against rounding. NaN where A cannot be factorised.
  Solution solve(std::span<const Twist> force) const;

 private:
  Eigen::VectorXd freedoms_of(std::span<const Twist> of) const;
  std::vector<Twist> twists_of(const Eigen::VectorXd& x) const;

  const BodyProblem& problem_;
  std::vector<double> rho_;
  std::vector<Eigen::Index> begin_;  ///< per unknown, its first freedom; and the number of all
  Eigen::SparseMatrix<double> matrix_;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor_;
};

}  // namespace talus
