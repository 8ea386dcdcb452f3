#pragma once

/// The coarse level of the solver in body space: groups of bodies that move as rigid ones.

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/body_problem.hpp"

namespace talus {

/// Which body belongs to which aggregate. Walls, and bodies without contacts, belong to none (-1): a wall is
/// a coarse unknown of its own, and a body without contacts needs none.
struct Aggregates {
  std::vector<std::int32_t> of_body;
  std::int32_t count = 0;
};

/// Grows connected groups of about `target` grains over the contacts, from the lowest body that has none;
/// what is left over and small joins a neighbour. Depends on the order of bodies and contacts alone.
Aggregates grow_aggregates(const BodyProblem& problem, int target);

/// A sensible `target`: 16 in small problems, so that chains get links; up to 256 in large ones, where the
/// coarse factorisation would cost more than it saves.
int aggregate_target(std::size_t bodies);

/// P^T A P and its factor, P the six rigid motions of each aggregate and the one of each wall: with them,
/// what takes sweeps over thousands of contacts to travel through a sample goes in one step. Where bodies do
/// not turn, their aggregates still do.
class CoarseLevel {
 public:
  CoarseLevel(const BodyProblem& problem, const Aggregates& aggregates, std::span<const double> rho);

  /// Factorises again with every rho multiplied by `factor` since the last call.
  void scale(double factor);

  /// x += P (P^T A P)^-1 P^T f.
  void correct(std::span<const Twist> f, std::span<Twist> x) const;

  Eigen::Index size() const { return mass_.rows(); }

 private:
  using Matrix = Eigen::SparseMatrix<double>;
  void assemble(std::span<const double> rho);
  void factorise();
  Eigen::Index wall_unknown(std::size_t body) const {
    return 6 * Eigen::Index{aggregates_.count} + static_cast<Eigen::Index>(body - problem_.grains);
  }
  Vec3 arm(std::size_t body) const;

  const BodyProblem& problem_;
  const Aggregates& aggregates_;
  std::vector<Vec3> centre_;    ///< per aggregate [m]
  std::vector<double> length_;  ///< per aggregate [m]: rotations are counted in length x angle
  Matrix mass_, stiffness_;
  double factor_ = 1;
  Eigen::SimplicialLDLT<Matrix> solver_;
};

}  // namespace talus
