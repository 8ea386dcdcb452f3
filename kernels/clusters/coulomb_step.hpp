#pragma once

/// One step of coulomb_newton.hpp: contacts that yield by Coulomb's law, and moments that resist rolling
/// within their bounds, around given impulses.

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>
#include <vector>

#include "kernels/clusters/block_elimination.hpp"
#include "kernels/clusters/freedoms.hpp"
#include "kernels/global/body_problem.hpp"

namespace talus {

/// What a contact carries: an impulse [N s], and a moment's, 0 where it does not resist rolling [N m s].
struct Carried {
  Vec3 r = Vec3::Zero(), m = Vec3::Zero();
};
/// What the contacts of a step begin from, and how firm they are: rho is so many 1/W_nn, 1/W_tt, and of
/// moments 1/(1/I_1 + 1/I_2).
struct CoulombStart {
  std::vector<Carried> t;  ///< per contact
  double firmness = 0;
};

/// What impulses along x, y and z at a contact, or moments about them, do to the blocks of freedoms that it
/// touches.
using ContactColumns = std::array<Eigen::Matrix<double, 6, 3>, std::tuple_size_v<Freedoms::Column>>;

/// What steps have still to change.
struct LinearRest {
  double momentum = std::numeric_limits<double>::infinity();  ///< of the motion [N s]
  double impulse = std::numeric_limits<double>::infinity();   ///< of a contact, over the largest of all
};

/// The problem of a step, over changes d of the freedoms of a cluster. The problem must outlive it.
class CoulombStep {
 public:
  using Vector = Eigen::VectorXd;

  explicit CoulombStep(const BodyProblem& problem);

  Vector none() const { return Vector::Zero(freedoms_.size()); }
  std::vector<Twist> twists(const Vector& d) const { return freedoms_.twists(d); }
  /// |f| in the norm of M^-1 times the root of all masses: at least the sum of |f| over the bodies [N s].
  double size(const Vector& f) const { return std::sqrt(mass_.sum() * f.cwiseQuotient(mass_).dot(f)); }

  /// What the law finds wrong with what contact k carries at d, as impulses, that of a moment at the smaller
  /// radius [N s].
  double wrong(std::size_t k, const Vector& d, const Carried& carried) const;
  /// r(d) and m(d) of contact k.
  Carried carried(std::size_t k, const Vector& d, const CoulombStart& start) const;
  /// M d - H (r(d) - r) [N s].
  Vector residual(const Vector& d, const CoulombStart& start) const;
  /// Newton's step from d, where the residual is f; its work is taken off. False where there is none.
  bool way(const Vector& d, const Vector& f, const CoulombStart& start, Vector& way, double& work) const;
  /// What steps behind the one from `start` to d change in all, if contacts stay as they are. To the
  /// motion: the R with H^T R = -(v + H^T d) at those that carry. That step has changed their impulses by
  /// what this asks for over rho, and has left a `residual`: (M + K) R = H (r(d) - t) - residual, of which K
  /// = H P' rho H^T need not have an inverse, and is made so firm that M hardly counts. To the impulses: what
  /// that firm step from there would add, r - t as often as it is firmer less P' rho H^T R; at contacts that
  /// open in this step all of t counts so, as who carries is then still being decided. Infinite where there
  /// is no solution.
  LinearRest linear_rest(const Vector& d, const CoulombStart& start, double firm_enough, double& work) const;

 private:
  /// A contact and the columns of H that belong to it.
  struct Columns {
    Freedoms::Column blocks;  ///< which ones: values are those of x
    ContactColumns H;
    bool rolls = false;
    ContactColumns turns;  ///< of moments; 0 where it does not roll
  };
  /// P' rho: of the impulse, of the moment by what moves the impulse, and by the rate of rolling.
  struct Slope {
    Mat3 force = Mat3::Zero(), moment_by_force = Mat3::Zero(), moment = Mat3::Zero();
  };

  void add_columns(std::size_t k);
  Carried evaluate(std::size_t k, const Vector& d, const CoulombStart& start, Slope* slope) const;
  Vec3 force(std::size_t k, const Vector& d, const CoulombStart& start, Mat3* slope) const;
  Vec3 velocity(std::size_t k, const Vector& d) const;
  Vec3 rate(std::size_t k, const Vector& d) const;
  Vec3 change(std::size_t k, const Vector& d) const;
  Vec3 turning(std::size_t k, const Vector& d) const;
  std::vector<Slope> slopes(const Vector& d, const CoulombStart& start) const;
  BlockElimination eliminated(const std::vector<Slope>& slope, double& work) const;
  void add_blocks(std::size_t k, const Slope& slope, BlockElimination& system) const;
  void add_force(std::size_t k, const Carried& carried, Vector& f) const;
  Carried asked(std::size_t k, const Slope& slope, const Vector& d) const;
  Vector product(const std::vector<Slope>& slope, const Vector& x) const;

  const BodyProblem& problem_;
  Freedoms freedoms_;
  Vector mass_;                              ///< per freedom [kg]
  std::vector<Vec3> velocity_;               ///< v + b n at the impulses of the problem [m/s]
  std::vector<Vec3> rate_;                   ///< of rolling, likewise [rad/s]
  std::vector<double> normal_, tangential_;  ///< 1/W_nn, 1/W_tt [kg]
  std::vector<Columns> columns_;             ///< per contact
};

}  // namespace talus
