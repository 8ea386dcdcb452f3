#pragma once

/// Direct solution of systems of 3x3 blocks, for the solvers that factorise W.

#include <Eigen/LU>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseLU>
#include <span>
#include <vector>

#include "kernels/delassus/delassus.hpp"

namespace talus::detail {

/// Up to so many contacts a matrix is stored and factorised densely: W of a few dozen contacts on few bodies
/// is full anyway, and an LU of 300 rows costs less than the analysis of a sparse one.
inline constexpr std::size_t dense_contacts = 100;

/// Order of elimination of the contacts, by nested dissection (METIS) of the graph of W's blocks. Any subset
/// of contacts, taken in this order, has little fill too: it is made once, for all active sets.
std::vector<std::int32_t> elimination_order(const DelassusProblem& problem);

/// Multiplications of a factorisation in that order with all contacts active and no pivoting, from the
/// symbolic elimination of blocks.
double factorisation_cost(const DelassusProblem& problem, std::span<const std::int32_t> order);

/// What solvers that factorise have in common, made once for all of them.
struct FactorisedForm {
  explicit FactorisedForm(const DelassusProblem& problem);
  UnitDiagonal scaled;
  std::vector<std::int32_t> order;  ///< of elimination
  double all_active;                ///< multiplications of an LU of the whole matrix
  /// Of one factorisation with a part of the contacts, 0 to 1, in multiplications of a sweep. Fitted to
  /// measured times, within a factor of 2.
  double factorisation_cost(double active = 1) const;
};

/// What making a FactorisedForm costs, likewise.
double analysis_cost(const DelassusProblem& problem);

struct BlockEntry {
  std::int32_t row, column;  ///< places in the order of elimination
  Mat3 block;
};

/// LU with pivoting, or LDL' when the caller knows the matrix to be symmetric and definite.
class BlockFactorisation {
 public:
  /// `rows`: contacts. False when the matrix is singular to rounding.
  bool factorise(std::size_t rows, std::span<const BlockEntry> entries, bool definite);
  /// Solves in place; 3 values per row.
  void solve(Eigen::VectorXd& x) const;
  /// Multiplications of a solution.
  double solve_cost() const;

 private:
  enum class Kind { dense, lu, ldlt } kind_ = Kind::dense;
  Eigen::PartialPivLU<Eigen::MatrixXd> dense_;
  Eigen::SparseLU<Eigen::SparseMatrix<double>, Eigen::NaturalOrdering<int>> lu_;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower, Eigen::NaturalOrdering<int>> ldlt_;
};

}  // namespace talus::detail
