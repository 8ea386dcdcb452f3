#include "kernels/delassus/detail/block_factorisation.hpp"

#include <metis.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace talus::detail {

std::vector<std::int32_t> elimination_order(const DelassusProblem& problem) {
  std::vector<std::int32_t> order(problem.contacts());
  std::iota(order.begin(), order.end(), 0);
  if (problem.column.empty() || problem.contacts() <= dense_contacts) return order;
  // The graph of W and W', as METIS wants it: every edge from both ends, none from a contact to itself.
  std::vector<std::vector<idx_t>> neighbours(problem.contacts());
  for (std::size_t a = 0; a < problem.contacts(); ++a) {
    for (auto k = problem.row_begin[a]; k < problem.row_begin[a + 1]; ++k) {
      const std::int32_t b = problem.column[static_cast<std::size_t>(k)];
      neighbours[a].push_back(static_cast<idx_t>(b));
      neighbours[static_cast<std::size_t>(b)].push_back(static_cast<idx_t>(a));
    }
  }
  std::vector<idx_t> begin{0}, edges;
  for (auto& list : neighbours) {
    std::sort(list.begin(), list.end());
    edges.insert(edges.end(), list.begin(), std::unique(list.begin(), list.end()));
    begin.push_back(static_cast<idx_t>(edges.size()));
  }
  auto size = static_cast<idx_t>(problem.contacts());
  std::vector<idx_t> contact_at(problem.contacts()), place(problem.contacts());
  // Without an order from METIS (out of memory) the natural one is right too, only slower.
  if (METIS_NodeND(&size, begin.data(), edges.data(), nullptr, nullptr, contact_at.data(), place.data()) ==
      METIS_OK)
    std::copy(contact_at.begin(), contact_at.end(), order.begin());
  return order;
}

double factorisation_cost(const DelassusProblem& problem, std::span<const std::int32_t> order) {
  const std::size_t n = problem.contacts();
  if (n <= dense_contacts)
    return 9.0 * static_cast<double>(n) * static_cast<double>(n) * static_cast<double>(n);
  std::vector<std::int32_t> place(n);
  for (std::size_t k = 0; k < n; ++k)
    place[static_cast<std::size_t>(order[k])] = static_cast<std::int32_t>(k);
  // Columns of the factor: those of the matrix below the diagonal, joined with those of their children in the
  // elimination tree.
  std::vector<std::vector<std::int32_t>> column(n);
  for (std::size_t a = 0; a < n; ++a) {
    for (auto k = problem.row_begin[a]; k < problem.row_begin[a + 1]; ++k) {
      const auto [low, high] =
          std::minmax(place[a], place[static_cast<std::size_t>(problem.column[static_cast<std::size_t>(k)])]);
      column[static_cast<std::size_t>(low)].push_back(high);
    }
  }
  double cost = 0;
  for (auto& rows : column) {
    std::sort(rows.begin(), rows.end());
    rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
    if (rows.empty()) continue;
    const auto below = static_cast<double>(rows.size());
    cost += 27 * below * below;
    auto& parent = column[static_cast<std::size_t>(rows.front())];
    parent.insert(parent.end(), rows.begin() + 1, rows.end());
  }
  return cost;
}

FactorisedForm::FactorisedForm(const DelassusProblem& problem)
    : scaled(unit_diagonal(problem)),
      order(elimination_order(problem)),
      all_active(detail::factorisation_cost(problem, order)) {}

double FactorisedForm::factorisation_cost(double active) const {
  const bool sparse = scaled.problem.contacts() > dense_contacts;
  const auto blocks = static_cast<double>(scaled.problem.column.size());
  const auto contacts = static_cast<double>(scaled.problem.contacts());
  return sparse ? 1.3 * all_active * active * std::sqrt(active) + active * (100 * blocks + 2000 * contacts)
                : 0.4 * all_active * active * active * active + active * (50 * blocks + 750 * contacts);
}

double analysis_cost(const DelassusProblem& problem) {
  const auto blocks = static_cast<double>(problem.column.size());
  const auto contacts = static_cast<double>(problem.contacts());
  return problem.contacts() > dense_contacts ? 400 * (blocks + 10 * contacts) : 50 * (blocks + contacts);
}

double BlockFactorisation::solve_cost() const {
  switch (kind_) {
    case Kind::dense:
      return 0.5 * static_cast<double>(dense_.rows()) * static_cast<double>(dense_.rows());
    case Kind::lu:
      return static_cast<double>(lu_.nnzL()) + static_cast<double>(lu_.nnzU());
    case Kind::ldlt:
      break;
  }
  return 2.0 * static_cast<double>(ldlt_.matrixL().nestedExpression().nonZeros());
}

bool BlockFactorisation::factorise(std::size_t rows, std::span<const BlockEntry> entries, bool definite) {
  const auto size = static_cast<Eigen::Index>(3 * rows);
  if (rows <= dense_contacts) {
    kind_ = Kind::dense;
    Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(size, size);
    for (const BlockEntry& e : entries) matrix.block<3, 3>(3 * e.row, 3 * e.column) += e.block;
    dense_.compute(matrix);
    return dense_.matrixLU().diagonal().cwiseAbs().minCoeff() > 0;
  }
  std::vector<Eigen::Triplet<double>> triplets;
  triplets.reserve(9 * entries.size());
  for (const BlockEntry& e : entries)
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        if (e.block(i, j) != 0 && (!definite || 3 * e.row + i >= 3 * e.column + j))
          triplets.emplace_back(3 * e.row + i, 3 * e.column + j, e.block(i, j));
  Eigen::SparseMatrix<double> matrix(size, size);
  matrix.setFromTriplets(triplets.begin(), triplets.end());
  if (definite) {
    kind_ = Kind::ldlt;
    ldlt_.compute(matrix);
    return ldlt_.info() == Eigen::Success;
  }
  kind_ = Kind::lu;
  lu_.setPivotThreshold(0.01);  // the diagonal unless it is small: the order of elimination is worth keeping
  lu_.compute(matrix);
  return lu_.info() == Eigen::Success;
}

void BlockFactorisation::solve(Eigen::VectorXd& x) const {
  switch (kind_) {
    case Kind::dense:
      x = dense_.solve(x).eval();
      break;
    case Kind::lu:
      x = lu_.solve(x).eval();
      break;
    case Kind::ldlt:
      x = ldlt_.solve(x).eval();
      break;
  }
}

}  // namespace talus::detail
