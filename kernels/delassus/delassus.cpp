#include "kernels/delassus/delassus.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

namespace talus {
namespace {

Vec3 at(std::span<const double> values, std::size_t contact) {
  return Eigen::Map<const Vec3>(values.data() + 3 * contact);
}

void put(std::span<double> values, std::size_t contact, const Vec3& value) {
  Eigen::Map<Vec3>(values.data() + 3 * contact) = value;
}

/// sqrt(D_c), D_c = trace(W_cc)/3; 1 where that is not positive.
double root_of_diagonal(const LocalBlock& block) {
  const double third = block.W.trace() / 3;
  return third > 0 ? std::sqrt(third) : 1;
}

/// Sums of squares of the natural map and of the three vectors it is compared with.
struct SquaredNorms {
  double map = 0, q = 0, r = 0, u = 0;
  double relative() const {
    const double size = std::sqrt(std::max({q, r, u}));
    const double error = std::sqrt(map);
    return size > 2.2e-16 ? error / size : error;
  }
};

}  // namespace

DelassusProblem assemble_delassus(std::span<const MatrixEntry> entries, std::span<const double> q,
                                  std::span<const double> mu) {
  const std::size_t contacts = mu.size();
  if (q.size() != 3 * contacts)
    throw std::invalid_argument("assemble_delassus: q has " + std::to_string(q.size()) + " values for " +
                                std::to_string(contacts) + " contacts, it needs 3 for each");
  const auto rows = static_cast<std::int64_t>(q.size());
  std::vector<std::size_t> order;
  order.reserve(entries.size());
  for (std::size_t k = 0; k < entries.size(); ++k) {
    const MatrixEntry& e = entries[k];
    if (e.row < 0 || e.row >= rows || e.column < 0 || e.column >= rows)
      throw std::invalid_argument("assemble_delassus: entry " + std::to_string(k) + " stands at (" +
                                  std::to_string(e.row) + ", " + std::to_string(e.column) + ") of a " +
                                  std::to_string(rows) + " x " + std::to_string(rows) + " matrix");
    order.push_back(k);
  }
  // Stable: entries at the same place are added in the order in which they came.
  const auto block_of = [&](std::size_t k) { return std::pair(entries[k].row / 3, entries[k].column / 3); };
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return block_of(a) < block_of(b); });

  DelassusProblem p;
  p.row_begin.reserve(contacts + 1);
  p.row_begin.push_back(0);
  p.diagonal.reserve(contacts);
  p.q.reserve(contacts);
  std::size_t next = 0;
  for (std::size_t a = 0; a < contacts; ++a) {
    Mat3 own = Mat3::Zero();
    while (next < order.size() && block_of(order[next]).first == static_cast<std::int64_t>(a)) {
      const std::int64_t column = block_of(order[next]).second;
      Mat3 block = Mat3::Zero();
      for (; next < order.size() && block_of(order[next]) == std::pair(static_cast<std::int64_t>(a), column);
           ++next) {
        const MatrixEntry& e = entries[order[next]];
        block(e.row % 3, e.column % 3) += e.value;
      }
      if (column == static_cast<std::int64_t>(a)) {
        own = block;
      } else {
        p.column.push_back(static_cast<std::int32_t>(column));
        p.block.push_back(block);
      }
    }
    p.row_begin.push_back(static_cast<std::int64_t>(p.column.size()));
    p.diagonal.push_back(local_block(own, mu[a]));
    p.q.push_back(at(q, a));
  }
  return p;
}

DelassusProblem embed_plane(std::span<const MatrixEntry> entries, std::span<const double> q,
                            std::span<const double> mu) {
  const std::size_t contacts = mu.size();
  if (q.size() != 2 * contacts)
    throw std::invalid_argument("embed_plane: q has " + std::to_string(q.size()) + " values for " +
                                std::to_string(contacts) + " contacts, it needs 2 for each");
  const auto rows = static_cast<std::int64_t>(q.size());
  const auto place = [](std::int64_t row) { return 3 * (row / 2) + row % 2; };
  std::vector<MatrixEntry> space;
  std::vector<double> trace(contacts, 0.0), q_space(3 * contacts, 0.0);
  space.reserve(entries.size() + contacts);
  for (const MatrixEntry& e : entries) {
    if (e.row < 0 || e.row >= rows || e.column < 0 || e.column >= rows)
      throw std::invalid_argument("embed_plane: an entry stands at (" + std::to_string(e.row) + ", " +
                                  std::to_string(e.column) + ") of a " + std::to_string(rows) + " x " +
                                  std::to_string(rows) + " matrix");
    space.push_back({place(e.row), place(e.column), e.value});
    if (e.row == e.column) trace[static_cast<std::size_t>(e.row / 2)] += e.value;
  }
  for (std::size_t a = 0; a < contacts; ++a) {
    const auto last = static_cast<std::int64_t>(3 * a + 2);
    space.push_back({last, last, 0.5 * trace[a]});
    q_space[3 * a] = q[2 * a];
    q_space[3 * a + 1] = q[2 * a + 1];
  }
  DelassusProblem p = assemble_delassus(space, q_space, mu);
  p.dimension = 2;
  return p;
}

std::vector<double> plane_components(std::span<const double> values) {
  std::vector<double> out;
  out.reserve(2 * values.size() / 3);
  for (std::size_t k = 0; k < values.size(); ++k)
    if (k % 3 != 2) out.push_back(values[k]);
  return out;
}

UnitDiagonal unit_diagonal(const DelassusProblem& problem) {
  UnitDiagonal scaled{problem, {}};
  scaled.root.reserve(problem.contacts());
  for (const LocalBlock& own : problem.diagonal) scaled.root.push_back(root_of_diagonal(own));
  DelassusProblem& p = scaled.problem;
  for (std::size_t a = 0; a < p.contacts(); ++a) {
    const double root = scaled.root[a];
    p.q[a] /= root;
    p.diagonal[a] = local_block(p.diagonal[a].W / (root * root), p.diagonal[a].mu);
    for (auto k = static_cast<std::size_t>(p.row_begin[a]); k < static_cast<std::size_t>(p.row_begin[a + 1]);
         ++k)
      p.block[k] /= root * scaled.root[static_cast<std::size_t>(p.column[k])];
  }
  return scaled;
}

void relative_velocity(const DelassusProblem& problem, std::span<const double> r, std::span<double> u) {
  if (std::all_of(r.begin(), r.end(), [](double value) { return value == 0; })) {
    for (std::size_t a = 0; a < problem.contacts(); ++a) put(u, a, problem.q[a]);  // the usual start
    return;
  }
  for (std::size_t a = 0; a < problem.contacts(); ++a)
    put(u, a, velocity_from_others(problem, r, a) + problem.diagonal[a].W * at(r, a));
}

DelassusError delassus_error(const DelassusProblem& problem, std::span<const double> r, std::span<double> u) {
  relative_velocity(problem, r, u);
  SquaredNorms plain, scaled;
  const auto add = [](SquaredNorms& sums, const Vec3& rc, const Vec3& uc, const Vec3& qc, double mu) {
    sums.map += natural_map(rc, uc, mu, 1).squaredNorm();
    sums.q += qc.squaredNorm();
    sums.r += rc.squaredNorm();
    sums.u += uc.squaredNorm();
  };
  for (std::size_t a = 0; a < problem.contacts(); ++a) {
    const LocalBlock& block = problem.diagonal[a];
    const double root = root_of_diagonal(block);
    const Vec3 rc = at(r, a), uc = at(u, a);
    add(plain, rc, uc, problem.q[a], block.mu);
    add(scaled, rc * root, uc / root, problem.q[a] / root, block.mu);
  }
  return {plain.relative(), scaled.relative()};
}

double measured(const DelassusError& error, ErrorMeasure measure) {
  switch (measure) {
    case ErrorMeasure::siconos:
      return error.siconos;
    case ErrorMeasure::scaled:
      return error.scaled;
    case ErrorMeasure::larger:
      break;
  }
  return std::max(error.siconos, error.scaled);
}

BestAnswer::BestAnswer(const DelassusProblem& problem, const DelassusGoal& goal, std::span<double> r)
    : problem_(problem), goal_(goal), out_(r), best_(r.begin(), r.end()), u_(r.size()) {
  report_.error = delassus_error(problem, r, u_);
  report_.history.reserve(64);
  report_.history.push_back({0, report_.error});
  least_ = last_ = measured(report_.error, goal.measure);
  report_.converged = least_ <= goal.tolerance;
}

bool BestAnswer::count() {
  ++report_.iterations;
  report_.stopped = goal_.stop && goal_.stop();
  return report_.stopped || report_.iterations >= goal_.max_iterations;
}

bool BestAnswer::offer(std::int64_t iteration, std::span<const double> candidate) {
  const DelassusError error = delassus_error(problem_, candidate, u_);
  report_.history.push_back({iteration, error});
  last_ = measured(error, goal_.measure);
  if (!(last_ < least_)) return false;
  least_ = last_;
  report_.error = error;
  report_.converged = least_ <= goal_.tolerance;
  std::copy(candidate.begin(), candidate.end(), best_.begin());
  return true;
}

DelassusReport BestAnswer::hand_back() {
  std::copy(best_.begin(), best_.end(), out_.begin());
  return std::move(report_);
}

}  // namespace talus
