#pragma once

/// A linear system over the bodies of a cluster, solved directly: one square block for each body and for each
/// two that touch.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/clusters/freedoms.hpp"

namespace talus {

/// Gauss' elimination, body by body, in an order that fills little (approximate minimum degree). Rows change
/// places within a body only, never between bodies: exact but for rounding where the symmetric part of the
/// matrix is positive definite, and whoever adds blocks of another kind has to look at what a solution
/// leaves.
///
/// Blocks are 3 x 3 where no body has more freedoms, else 6 x 6, those of bodies with fewer freedoms filled
/// up by the identity. The freedoms must outlive this.
class BlockElimination {
 public:
  /// Two bodies with blocks off the diagonal, in both places.
  using Pair = std::array<std::int32_t, 2>;
  /// A = diag(`diagonal`), one number per freedom, all > 0. Pairs in any order and as often as they like.
  BlockElimination(const Freedoms& freedoms, const Eigen::VectorXd& diagonal, std::span<const Pair> pairs);

  /// A += block, whose upper left corner of as many rows and columns as the bodies have freedoms counts. Both
  /// are one body, or a pair of those given.
  void add(std::int32_t row, std::int32_t column, const Eigen::Matrix<double, 6, 6>& block);

  /// Once, behind all that is added. Entries that are not finite, or a body whose block is singular, make
  /// solutions that are not finite.
  void factorise();
  /// A x = f, over the freedoms.
  Eigen::VectorXd solve(const Eigen::VectorXd& f) const;

  /// Multiplications of `factorise`.
  double work() const { return work_; }

 private:
  void order(std::span<const Pair> pairs);
  void find_pattern(std::span<const Pair> pairs);
  std::size_t place(std::int32_t row, std::int32_t column) const;
  template <int size>
  void eliminate();
  template <int size>
  void substitute(Eigen::VectorXd& x) const;

  const Freedoms& freedoms_;
  Eigen::Index size_ = 3;              ///< of a block
  std::vector<std::int32_t> pivot_;    ///< per body: when it is eliminated
  std::vector<std::size_t> begin_;     ///< per pivot: its first in `later_`; and the number of all
  std::vector<std::int32_t> later_;    ///< pivots of the bodies that are still coupled to one, ascending
  std::vector<double> diagonal_;       ///< per pivot: its block; its factors L and U behind `factorise`
  std::vector<int> rows_;              ///< per pivot, so many as a block has: which row of the block is where
  std::vector<double> below_, above_;  ///< per entry of `later_`: block in its row, in its column; behind
                                       ///< `factorise` over U, and L^-1 times it
  double work_ = 0;
};

}  // namespace talus
