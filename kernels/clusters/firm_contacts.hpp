#pragma once

/// The linear system of a cluster whose contacts are springs, so firm that next to nothing gives way.

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "kernels/clusters/block_elimination.hpp"
#include "kernels/clusters/freedoms.hpp"
#include "kernels/clusters/rolling_contacts.hpp"
#include "kernels/global/body_problem.hpp"

namespace talus {

/// A spring of a contact: it resists relative velocities along a direction.
struct ContactSpring {
  std::size_t contact = 0;
  Vec3 direction = Vec3::Zero();  ///< unit
  double stiffness = 0;           ///< impulse per velocity [kg], > 0
};

/// A = M + sum of H e k e^T H^T, springs of direction e and stiffness k, over the freedoms of the bodies,
/// factorised directly.
class FirmContacts {
 public:
  /// Each contact with the stiffness rho of `firmness` effective masses: along its normal, with mu > 0 in all
  /// directions; and these springs of moments. Costs an elimination.
  FirmContacts(const BodyProblem& problem, double firmness, std::span<const MomentSpring> moments = {});
  /// With these springs. The same cost.
  FirmContacts(const BodyProblem& problem, std::span<const ContactSpring> springs)
      : FirmContacts(problem, springs, {}) {}

  // The elimination knows the freedoms by their place.
  FirmContacts(const FirmContacts&) = delete;
  FirmContacts& operator=(const FirmContacts&) = delete;

  double rho(std::size_t contact) const { return rho_[contact]; }  ///< [kg], of the first kind

  double work() const { return system_.work(); }  ///< multiplications of the elimination

  struct Solution {
    std::vector<Twist> motion;  ///< per unknown [m/s]
    std::vector<Twist> last;    ///< by which the last refinement has changed it: about its error
  };
  /// A motion = force [N s], refined against rounding. Not finite where A cannot be factorised.
  Solution solve(std::span<const Twist> force) const;

 private:
  FirmContacts(const BodyProblem& problem, std::span<const ContactSpring> springs,
               std::span<const MomentSpring> moments);

  /// What a spring does to the bodies of its contact.
  struct Column {
    Freedoms::Column parts;
    double stiffness;
  };
  static std::vector<Column> columns_of(const BodyProblem& problem, const Freedoms& freedoms,
                                        std::span<const ContactSpring> springs,
                                        std::span<const MomentSpring> moments);
  static std::vector<BlockElimination::Pair> pairs_of(std::span<const Column> columns);
  Eigen::VectorXd product(const Eigen::VectorXd& x) const;

  Freedoms freedoms_;
  Eigen::VectorXd masses_;  ///< per freedom [kg]
  std::vector<double> rho_;
  std::vector<Column> columns_;
  BlockElimination system_;
};

}  // namespace talus
