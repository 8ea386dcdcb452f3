#include "kernels/clusters/block_elimination.hpp"

#include <Eigen/LU>
#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>

#include "kernels/bodies/index.hpp"

namespace talus {

namespace {

template <int size>
using Block = Eigen::Map<Eigen::Matrix<double, size, size>>;
template <int size>
using ConstBlock = Eigen::Map<const Eigen::Matrix<double, size, size>>;

/// x becomes L^-1 P x, a column.
template <int size, class Column>
void divide_by_lower(const ConstBlock<size>& factors, const int* rows, Column&& x) {
  const Eigen::Matrix<double, size, 1> given = x;
  for (int k = 0; k < size; ++k) {
    double value = given[rows[k]];
    for (int l = 0; l < k; ++l) value -= factors(k, l) * x[l];
    x[k] = value;
  }
}

/// x becomes U^-1 x, a column.
template <int size, class Column>
void divide_by_upper(const ConstBlock<size>& factors, Column&& x) {
  for (int k = size - 1; k >= 0; --k) {
    for (int l = k + 1; l < size; ++l) x[k] -= factors(k, l) * x[l];
    x[k] /= factors(k, k);
  }
}

/// X becomes X U^-1.
template <int size>
void divide_from_right(const ConstBlock<size>& factors, Block<size> X) {
  for (int k = 0; k < size; ++k) {
    for (int l = 0; l < k; ++l) X.col(k) -= factors(l, k) * X.col(l);
    X.col(k) /= factors(k, k);
  }
}

}  // namespace

BlockElimination::BlockElimination(const Freedoms& freedoms, const Eigen::VectorXd& diagonal,
                                   std::span<const Pair> pairs)
    : freedoms_(freedoms) {
  for (std::size_t b = 0; b < freedoms.blocks(); ++b) size_ = freedoms.count(b) > 3 ? 6 : size_;
  order(pairs);
  find_pattern(pairs);
  const auto area = static_cast<std::size_t>(size_ * size_);
  diagonal_.assign(area * pivot_.size(), 0);
  below_.assign(area * later_.size(), 0);
  above_.assign(area * later_.size(), 0);
  for (std::size_t b = 0; b < pivot_.size(); ++b)
    for (Eigen::Index k = 0; k < size_; ++k)
      diagonal_[at(pivot_[b]) * area + static_cast<std::size_t>(k * (size_ + 1))] =
          k < freedoms.count(b) ? diagonal[freedoms.begin(b) + k] : 1;
}

void BlockElimination::order(std::span<const Pair> pairs) {
  const auto n = static_cast<Eigen::Index>(freedoms_.blocks());
  std::vector<Eigen::Triplet<double>> entries;
  for (Eigen::Index b = 0; b < n; ++b) entries.emplace_back(b, b, 1);
  for (const auto& [a, b] : pairs) {
    entries.emplace_back(a, b, 1);
    entries.emplace_back(b, a, 1);
  }
  Eigen::SparseMatrix<double> touch(n, n);
  touch.setFromTriplets(entries.begin(), entries.end());
  Eigen::AMDOrdering<int>::PermutationType body_of_pivot;
  Eigen::AMDOrdering<int>()(touch, body_of_pivot);
  pivot_.resize(freedoms_.blocks());
  for (Eigen::Index k = 0; k < n; ++k) pivot_[at(body_of_pivot.indices()[k])] = static_cast<std::int32_t>(k);
}

/// A body that goes couples all those that are still coupled to it: to hand them to the first of these is
/// enough, as it hands them on.
void BlockElimination::find_pattern(std::span<const Pair> pairs) {
  std::vector<std::vector<std::int32_t>> later(pivot_.size());
  for (const auto& [a, b] : pairs) {
    const std::int32_t first = std::min(pivot_[at(a)], pivot_[at(b)]),
                       second = std::max(pivot_[at(a)], pivot_[at(b)]);
    if (first != second) later[at(first)].push_back(second);
  }
  begin_.push_back(0);
  const auto volume = static_cast<double>(size_ * size_ * size_);
  for (std::vector<std::int32_t>& of : later) {
    std::sort(of.begin(), of.end());
    of.erase(std::unique(of.begin(), of.end()), of.end());
    if (!of.empty()) {
      std::vector<std::int32_t>& heir = later[at(of.front())];
      heir.insert(heir.end(), of.begin() + 1, of.end());
    }
    later_.insert(later_.end(), of.begin(), of.end());
    begin_.push_back(later_.size());
    const auto n = static_cast<double>(of.size());
    work_ += (1 + n + n * n) * volume;
  }
}

/// Of the block of two bodies, by their pivots, the earlier first: in `later_`.
std::size_t BlockElimination::place(std::int32_t first, std::int32_t second) const {
  const auto from = later_.begin() + static_cast<std::ptrdiff_t>(begin_[at(first)]),
             to = later_.begin() + static_cast<std::ptrdiff_t>(begin_[at(first) + 1]);
  return static_cast<std::size_t>(std::lower_bound(from, to, second) - later_.begin());
}

void BlockElimination::add(std::int32_t row, std::int32_t column, const Eigen::Matrix<double, 6, 6>& block) {
  const std::int32_t i = pivot_[at(row)], j = pivot_[at(column)];
  const auto area = static_cast<std::size_t>(size_ * size_);
  double* const entries = i == j  ? &diagonal_[at(i) * area]
                          : i > j ? &below_[place(j, i) * area]
                                  : &above_[place(i, j) * area];
  const Eigen::Index rows = freedoms_.count(at(row)), columns = freedoms_.count(at(column));
  Eigen::Map<Eigen::MatrixXd>(entries, size_, size_).topLeftCorner(rows, columns) +=
      block.topLeftCorner(rows, columns);
}

template <int size>
void BlockElimination::eliminate() {
  constexpr std::size_t area = size * size;
  rows_.resize(size * pivot_.size());
  for (std::size_t k = 0; k < pivot_.size(); ++k) {
    Block<size> diagonal(&diagonal_[k * area]);
    int* const rows = &rows_[k * size];
    const Eigen::PartialPivLU<Eigen::Matrix<double, size, size>> lu(diagonal);
    diagonal = lu.matrixLU();
    for (int row = 0; row < size; ++row) rows[lu.permutationP().indices()[row]] = row;
    const ConstBlock<size> factors(diagonal.data());
    for (std::size_t a = begin_[k]; a < begin_[k + 1]; ++a) {
      divide_from_right<size>(factors, Block<size>(&below_[a * area]));
      Block<size> above(&above_[a * area]);
      for (int column = 0; column < size; ++column) divide_by_lower<size>(factors, rows, above.col(column));
    }
    for (std::size_t a = begin_[k]; a < begin_[k + 1]; ++a) {
      const ConstBlock<size> row(&below_[a * area]), column(&above_[a * area]);
      const std::size_t i = at(later_[a]);
      Block<size>(&diagonal_[i * area]).noalias() -= row * column;
      // Those that are coupled to k behind i are coupled to i as well.
      std::size_t of_i = begin_[i];
      for (std::size_t b = a + 1; b < begin_[k + 1]; ++b, ++of_i) {
        while (later_[of_i] != later_[b]) ++of_i;
        Block<size>(&above_[of_i * area]).noalias() -= row * ConstBlock<size>(&above_[b * area]);
        Block<size>(&below_[of_i * area]).noalias() -= ConstBlock<size>(&below_[b * area]) * column;
      }
    }
  }
}

void BlockElimination::factorise() {
  size_ == 3 ? eliminate<3>() : eliminate<6>();
}

/// `x`: blocks by pivots.
template <int size>
void BlockElimination::substitute(Eigen::VectorXd& x) const {
  constexpr std::size_t area = size * size;
  const auto part = [&](std::size_t k) { return x.segment<size>(static_cast<Eigen::Index>(k) * size); };
  const auto factors = [&](std::size_t k) { return ConstBlock<size>(&diagonal_[k * area]); };
  for (std::size_t k = 0; k < pivot_.size(); ++k) {
    divide_by_lower<size>(factors(k), &rows_[k * size], part(k));
    for (std::size_t a = begin_[k]; a < begin_[k + 1]; ++a)
      part(at(later_[a])) -= ConstBlock<size>(&below_[a * area]) * part(k);
  }
  for (std::size_t k = pivot_.size(); k-- > 0;) {
    for (std::size_t a = begin_[k]; a < begin_[k + 1]; ++a)
      part(k) -= ConstBlock<size>(&above_[a * area]) * part(at(later_[a]));
    divide_by_upper<size>(factors(k), part(k));
  }
}

Eigen::VectorXd BlockElimination::solve(const Eigen::VectorXd& f) const {
  Eigen::VectorXd x = Eigen::VectorXd::Zero(size_ * static_cast<Eigen::Index>(pivot_.size()));
  for (std::size_t b = 0; b < pivot_.size(); ++b)
    x.segment(size_ * pivot_[b], freedoms_.count(b)) = f.segment(freedoms_.begin(b), freedoms_.count(b));
  size_ == 3 ? substitute<3>(x) : substitute<6>(x);
  Eigen::VectorXd solution(freedoms_.size());
  for (std::size_t b = 0; b < pivot_.size(); ++b)
    solution.segment(freedoms_.begin(b), freedoms_.count(b)) =
        x.segment(size_ * pivot_[b], freedoms_.count(b));
  return solution;
}

}  // namespace talus
