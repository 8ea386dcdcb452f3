#pragma once

/// The linear system of a cluster whose contacts are springs, so firm that next to nothing gives way.

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <span>
#include <vector>

#include "kernels/clusters/freedoms.hpp"
#include "kernels/global/body_problem.hpp"

namespace talus {

/// A spring of a contact: it resists relative velocities along a direction.
struct ContactSpring {
  std::size_t contact = 0;
  Vec3 direction = Vec3::Zero();  ///< unit
  double stiffness = 0;           ///< impulse per velocity [kg], > 0
};

/// A = M + sum of H e k e^T H^T, springs of direction e and stiffness k, over the freedoms of the bodies (3
/// of a grain, 6 where it turns, 1 of a wall), factorised directly.
class FirmContacts {
 public:
  /// Each contact with the stiffness rho of `firmness` effective masses: along its normal, with mu > 0 in all
  /// directions. Costs a sparse Cholesky factorisation.
  FirmContacts(const BodyProblem& problem, double firmness);
  /// With these springs. The same cost.
  FirmContacts(const BodyProblem& problem, std::span<const ContactSpring> springs);

  double rho(std::size_t contact) const { return rho_[contact]; }  ///< [kg], of the first kind

  /// Multiplications that it has taken, about: of the factor, and of what it is put together from.
  double work() const { return work_; }

  struct Solution {
    std::vector<Twist> motion;  ///< per unknown [m/s]
    std::vector<Twist> last;    ///< by which the last refinement has changed it: about its error
  };
  /// A motion = force [N s], refined against rounding. NaN where A cannot be factorised.
  Solution solve(std::span<const Twist> force) const;

 private:
  void factorise(std::span<const ContactSpring> springs);

  const BodyProblem& problem_;
  Freedoms freedoms_;
  std::vector<double> rho_;
  Eigen::SparseMatrix<double> matrix_;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor_;
  double work_ = 0;
};

}  // namespace talus
