#include "kernels/delassus/global_problem.hpp"

#include <Eigen/LU>
#include <Eigen/SparseLU>
#include <algorithm>
#include <numeric>
#include <stdexcept>
#include <string>

namespace talus {
namespace {

using Matrix = Eigen::MatrixXd;

void demand_inside(const char* name, std::span<const MatrixEntry> entries, std::size_t rows,
                   std::size_t columns) {
  for (const MatrixEntry& e : entries)
    if (e.row < 0 || e.column < 0 || static_cast<std::size_t>(e.row) >= rows ||
        static_cast<std::size_t>(e.column) >= columns)
      throw std::invalid_argument(std::string("global problem: an entry of ") + name + " stands at (" +
                                  std::to_string(e.row) + ", " + std::to_string(e.column) + ") of a " +
                                  std::to_string(rows) + " x " + std::to_string(columns) + " matrix");
}

void demand_sizes(const GlobalProblem& p) {
  if (p.dimension != 2 && p.dimension != 3)
    throw std::invalid_argument("global problem: dimension " + std::to_string(p.dimension) +
                                ", it must be 2 or 3");
  const std::size_t rows = p.f.size(), contact_rows = p.w.size();
  if (contact_rows != static_cast<std::size_t>(p.dimension) * p.mu.size())
    throw std::invalid_argument("global problem: w has " + std::to_string(contact_rows) + " values for " +
                                std::to_string(p.mu.size()) + " contacts");
  demand_inside("M", p.M, rows, rows);
  demand_inside("H", p.H, rows, contact_rows);
  demand_inside("G", p.G, rows, p.b.size());
}

/// Connected blocks of the matrix [M -G; G' 0], "bodies", and its inverse on each.
class Bodywise {
 public:
  explicit Bodywise(const GlobalProblem& p) : rows_(p.f.size() + p.b.size()), body_(rows_), local_(rows_) {
    std::vector<MatrixEntry> entries = p.M;
    const auto n = static_cast<std::int64_t>(p.f.size());
    for (const MatrixEntry& e : p.G) {
      entries.push_back({e.row, n + e.column, -e.value});
      entries.push_back({n + e.column, e.row, e.value});
    }
    number_bodies(entries);
    own_.resize(members_.size());
    for (const MatrixEntry& e : entries) own_[body_[static_cast<std::size_t>(e.row)]].push_back(e);
  }

  std::size_t bodies() const { return members_.size(); }
  std::size_t body_of(std::int64_t row) const { return body_[static_cast<std::size_t>(row)]; }
  std::size_t local_row(std::int64_t row) const { return local_[static_cast<std::size_t>(row)]; }
  std::span<const std::size_t> members(std::size_t body) const { return members_[body]; }

  /// The inverse of a body's matrix times B (rows: the body's, in the order of `members`).
  Matrix solve(std::size_t body, const Matrix& B) const {
    const auto size = static_cast<Eigen::Index>(members_[body].size());
    const auto place = [&](std::int64_t row) { return static_cast<Eigen::Index>(local_row(row)); };
    const auto singular = [&] {
      throw std::invalid_argument("global problem: M is singular on the body that begins at row " +
                                  std::to_string(members_[body].front()));
    };
    constexpr Eigen::Index dense_rows = 300;
    if (size <= dense_rows) {
      Matrix own = Matrix::Zero(size, size);
      for (const MatrixEntry& e : own_[body]) own(place(e.row), place(e.column)) += e.value;
      const Eigen::PartialPivLU<Matrix> lu(own);
      if (!(lu.matrixLU().diagonal().cwiseAbs().minCoeff() > 0)) singular();
      return lu.solve(B);
    }
    std::vector<Eigen::Triplet<double>> triplets;
    for (const MatrixEntry& e : own_[body])
      triplets.emplace_back(static_cast<int>(place(e.row)), static_cast<int>(place(e.column)), e.value);
    Eigen::SparseMatrix<double> own(size, size);
    own.setFromTriplets(triplets.begin(), triplets.end());
    Eigen::SparseLU<Eigen::SparseMatrix<double>> lu(own);
    if (lu.info() != Eigen::Success) singular();
    return lu.solve(B);
  }

 private:
  /// Numbers the connected components by their first row.
  void number_bodies(std::span<const MatrixEntry> entries) {
    std::vector<std::size_t> parent(rows_);
    std::iota(parent.begin(), parent.end(), std::size_t{0});
    const auto root = [&](std::size_t k) {
      while (parent[k] != k) k = parent[k] = parent[parent[k]];
      return k;
    };
    for (const MatrixEntry& e : entries) {
      const auto [low, high] =
          std::minmax({root(static_cast<std::size_t>(e.row)), root(static_cast<std::size_t>(e.column))});
      parent[high] = low;
    }
    for (std::size_t k = 0; k < rows_; ++k) {
      const std::size_t first = root(k);
      if (first == k) {
        body_[k] = members_.size();
        members_.emplace_back();
      }
      body_[k] = body_[first];
      local_[k] = members_[body_[k]].size();
      members_[body_[k]].push_back(k);
    }
  }

  std::size_t rows_;
  std::vector<std::size_t> body_, local_;          ///< per row
  std::vector<std::vector<std::size_t>> members_;  ///< per body: its rows, ascending
  std::vector<std::vector<MatrixEntry>> own_;      ///< per body
};

/// f with -b below it: the right-hand side without contacts.
std::vector<double> load(const GlobalProblem& p) {
  std::vector<double> values = p.f;
  for (const double b : p.b) values.push_back(-b);
  return values;
}

}  // namespace

DelassusProblem condense(const GlobalProblem& problem) {
  demand_sizes(problem);
  const Bodywise bodies(problem);
  const std::vector<double> f = load(problem);
  std::vector<std::vector<MatrixEntry>> H_of(bodies.bodies());
  for (const MatrixEntry& e : problem.H) H_of[bodies.body_of(e.row)].push_back(e);

  std::vector<MatrixEntry> W;
  std::vector<double> q = problem.w;
  for (std::size_t body = 0; body < bodies.bodies(); ++body) {
    if (H_of[body].empty()) continue;
    std::vector<std::int64_t> columns;  // of H that the body's rows touch
    for (const MatrixEntry& e : H_of[body]) columns.push_back(e.column);
    std::sort(columns.begin(), columns.end());
    columns.erase(std::unique(columns.begin(), columns.end()), columns.end());
    const auto size = static_cast<Eigen::Index>(bodies.members(body).size());
    const auto width = static_cast<Eigen::Index>(columns.size());
    // The last column is the load.
    Matrix H = Matrix::Zero(size, width + 1);
    for (const MatrixEntry& e : H_of[body]) {
      const auto column = std::lower_bound(columns.begin(), columns.end(), e.column) - columns.begin();
      H(static_cast<Eigen::Index>(bodies.local_row(e.row)), column) += e.value;
    }
    for (Eigen::Index k = 0; k < size; ++k)
      H(k, width) = f[bodies.members(body)[static_cast<std::size_t>(k)]];
    const Matrix product = H.leftCols(width).transpose() * bodies.solve(body, H);
    for (Eigen::Index i = 0; i < width; ++i) {
      const std::int64_t row = columns[static_cast<std::size_t>(i)];
      q[static_cast<std::size_t>(row)] += product(i, width);
      for (Eigen::Index j = 0; j < width; ++j)
        if (product(i, j) != 0) W.push_back({row, columns[static_cast<std::size_t>(j)], product(i, j)});
    }
  }
  return problem.dimension == 2 ? embed_plane(W, q, problem.mu) : assemble_delassus(W, q, problem.mu);
}

GlobalVelocity global_velocity(const GlobalProblem& problem, std::span<const double> r) {
  demand_sizes(problem);
  if (r.size() != problem.w.size())
    throw std::invalid_argument("global_velocity: r has " + std::to_string(r.size()) + " values instead of " +
                                std::to_string(problem.w.size()));
  std::vector<double> rhs = load(problem);
  for (const MatrixEntry& e : problem.H)
    rhs[static_cast<std::size_t>(e.row)] += e.value * r[static_cast<std::size_t>(e.column)];
  const Bodywise bodies(problem);
  std::vector<double> both(rhs.size());
  for (std::size_t body = 0; body < bodies.bodies(); ++body) {
    const auto members = bodies.members(body);
    Matrix own(static_cast<Eigen::Index>(members.size()), 1);
    for (std::size_t k = 0; k < members.size(); ++k) own(static_cast<Eigen::Index>(k), 0) = rhs[members[k]];
    own = bodies.solve(body, own);
    for (std::size_t k = 0; k < members.size(); ++k) both[members[k]] = own(static_cast<Eigen::Index>(k), 0);
  }
  const auto n = static_cast<std::ptrdiff_t>(problem.f.size());
  return {{both.begin(), both.begin() + n}, {both.begin() + n, both.end()}};
}

}  // namespace talus
