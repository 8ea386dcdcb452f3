#pragma once

/// The matrix A = M + H rho H^T over the bodies of one part, never assembled, and its block Gauss-Seidel
/// passes.

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/global/body_problem.hpp"

namespace talus {

/// The share of one part in A. A contact between two grains that count here is stored with both of them, as
/// rows, over which the Gauss-Seidel passes go. Every other contact of two bodies, at a wall of finite mass
/// or with a grain that counts elsewhere, is a `tie`: between parts, and between grains and walls, the passes
/// are block Jacobi. They converge for any such split: with D the blocks on the diagonal, of all contacts of
/// a body, and T the ties, D - T = M + sum rho |H_i^T x_i - H_j^T x_j|^2 > 0.
/// A cell that follows a stress, which all contacts push, has a block of its own. The passes leave out what
/// couples it to grains, since no pass could go over all contacts for it. A preconditioner may drop that: the
/// two-by-two split that is left has eigenvalues between 0 and 2. A product goes over the links, 48 bytes and
/// 2 twists read and written each, about 70 flop. Passes go over the rows, in a stream of 48 bytes and a
/// gathered twist each: indices of links instead, a third of the bytes, took 1.8 times as long. 320 bytes a
/// body, 144 a contact.
///
/// With m = +-n pointing to the body of the row, seen from there the relative velocity is
/// v = (u_i - u_j) + m x (w_i + w_j), and the row gains rho (v, -m x v). Where a contact has no friction only
/// (m.v) m counts. A contact of blocks has v = (u_i - u_j) + B_i w_i - B_j w_j and the row gains
/// rho (v, B_i^T v): its levers are read from the problem.
class BodySystem {
 public:
  using Matrix6 = Eigen::Matrix<double, 6, 6>;

  /// Keeps a reference to `problem`. `rho` [kg]: one per contact, > 0. Until `close` is called, `diagonal`
  /// holds the blocks of H rho H^T that the contacts of this part give.
  BodySystem(const BodyProblem& problem, std::span<const double> rho);

  std::vector<Matrix6>& diagonal() { return diagonal_; }
  /// Inverts the diagonal blocks, once `diagonal` holds the contributions of all parts. It is empty then.
  void close();
  /// Per unknown: some part has contacts of it.
  const std::vector<char>& touched() const { return touched_; }

  // Twists are restricted to the freedoms of their bodies. Results are parts of a sum over the copies of a
  // body, unless said otherwise.

  /// y = A x.
  void multiply(std::span<const Twist> x, std::span<Twist> y) const;

  /// First half of the symmetric smoother, from 0: x = (D + L)^-1 f.
  void smooth_forward(std::span<const Twist> f, std::span<Twist> x) const;
  /// The residual f - A x of the summed x.
  void rest_of_forward(std::span<const Twist> x, std::span<Twist> rest) const;
  /// f less what ties add to A x, for the second half.
  void take_ties(std::span<const Twist> f, std::span<const Twist> x, std::span<Twist> rest) const;
  /// Second half: one backward pass from x, whose `rest` is summed.
  void smooth_backward(std::span<const Twist> rest, std::span<Twist> x) const;

  std::size_t size() const { return inertia_.size(); }

 private:
  static constexpr std::int32_t rough = -1, slick = -2;  ///< contacts of spheres; slick: normal part only
  /// What the product needs of a contact.
  struct Link {
    Vec3 normal;
    double rho;
    std::int32_t first, second;  ///< unknowns; second -1 at a driven wall
    std::int32_t kind;           ///< rough, slick, or of blocks and then 2 x the contact
  };
  /// A contact as a body of its own sees it.
  struct Edge {
    Vec3 m;
    double rho;
    std::int32_t other;  ///< unknown
    std::int32_t kind;   ///< as in Link; of blocks 2 x the contact, and 1 more for its second body
  };
  struct Inertia {
    double mass, spin_mass;  ///< [kg]; 0 where the body counts elsewhere
  };
  void take(const Edge& edge, std::span<const Twist> x, Twist& f) const;
  void take_from_block(const Edge& edge, std::span<const Twist> x, Twist& f) const;
  static void add_own_block(const Vec3& m, double rho, std::int32_t kind, Matrix6& block);
  void add_block_of_blocks(const ContactEquation& contact, double rho);
  void add_block_of_cell(const ContactEquation& contact, double rho);
  void multiply_with_cell(std::span<const Twist> x, std::span<Twist> y) const;
  void take_ties(std::span<const Twist> x, std::span<Twist> f) const;
  void restrict_all(std::span<Twist> f) const;

  const BodyProblem& problem_;
  std::vector<Link> links_;                  ///< per contact
  std::vector<Inertia> inertia_;             ///< per body
  std::vector<std::size_t> begin_, middle_;  ///< per body + 1; edges to lower unknowns stand before middle_
  std::vector<Edge> edges_;
  std::vector<std::uint32_t> ties_;  ///< links
  std::vector<char> touched_;
  std::vector<Matrix6> diagonal_;  ///< of H rho H^T
  std::vector<Matrix6> inverse_;   ///< of the blocks of A, on the freedoms of each body; 0 where it counts
                                   ///< elsewhere
};

}  // namespace talus
