#pragma once

/// The matrix A = M + H rho H^T over bodies, never assembled, and its block Gauss-Seidel passes.

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/body_problem.hpp"

namespace talus {

/// A as rows of bodies: every contact stands with both of its bodies, so that a row is computed by itself
/// (rows can be dealt to threads, and sums do not depend on how). Per contact and product: 2 records of 48
/// bytes and 2 gathered twists, about 80 flop. 380 bytes a body and 96 a contact.
///
/// With m = +-n pointing to the body of the row, seen from there the relative velocity is
/// v = (u_i - u_j) + m x (w_i + w_j), and the row gains rho (v, -m x v). Where a contact has no friction only
/// (m.v) m counts.
class BodySystem {
 public:
  /// Keeps a reference to `problem`. `rho` [kg]: one per contact, > 0.
  BodySystem(const BodyProblem& problem, std::span<const double> rho);

  /// Multiplies every rho by `factor`.
  void scale(double factor);

  /// y = A x. All twists are restricted to the freedoms of their bodies.
  void multiply(std::span<const Twist> x, std::span<Twist> y) const;

  /// First half of the symmetric smoother from x = 0: x = (D + L)^-1 f, and what is left, f - A x.
  void smooth_forward(std::span<const Twist> f, std::span<Twist> x, std::span<Twist> rest) const;
  /// Second half: one backward Gauss-Seidel pass on A x = f.
  void smooth_backward(std::span<const Twist> f, std::span<Twist> x) const;

  std::size_t size() const { return diagonal_.size(); }

 private:
  using Matrix6 = Eigen::Matrix<double, 6, 6>;
  struct Edge {
    Vec3 m;
    double rho;
    std::int32_t other;  ///< unknown
    std::int32_t slick;  ///< 1: normal part only
  };
  void invert_diagonal();
  template <bool Add>
  static void couple(const Edge& edge, const Twist& x, Twist& f);

  const BodyProblem& problem_;
  std::vector<std::size_t> begin_, middle_;  ///< per body + 1; edges to lower unknowns stand before middle_
  std::vector<Edge> edges_;
  std::vector<Matrix6> diagonal_;  ///< of H rho H^T
  std::vector<Matrix6> inverse_;   ///< of the blocks of A, on the freedoms of each body
};

}  // namespace talus
