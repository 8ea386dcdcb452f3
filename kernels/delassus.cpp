#include "kernels/delassus.hpp"

#include <algorithm>
#include <cmath>
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

/// q_a + sum of W_ab r_b over b != a: what the others do to contact a. 9 doubles and 18 flops a block.
Vec3 velocity_from_others(const DelassusProblem& p, std::span<const double> r, std::size_t a) {
  Vec3 u = p.q[a];
  for (std::int64_t k = p.row_begin[a]; k < p.row_begin[a + 1]; ++k) {
    const auto place = static_cast<std::size_t>(k);
    u += p.block[place] * at(r, static_cast<std::size_t>(p.column[place]));
  }
  return u;
}

/// One sweep; returns the number of contacts whose law had no solution.
std::int64_t sweep(const DelassusProblem& p, std::span<double> r) {
  std::int64_t failed = 0;
  for (std::size_t a = 0; a < p.contacts(); ++a) {
    const LocalSolution s = solve_local(p.diagonal[a], velocity_from_others(p, r, a), at(r, a));
    put(r, a, s.r);
    failed += s.status == LocalStatus::failed;
  }
  return failed;
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

void relative_velocity(const DelassusProblem& problem, std::span<const double> r, std::span<double> u) {
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
    const double third = block.W.trace() / 3;
    const double root = third > 0 ? std::sqrt(third) : 1;
    const Vec3 rc = at(r, a), uc = at(u, a);
    add(plain, rc, uc, problem.q[a], block.mu);
    add(scaled, rc * root, uc / root, problem.q[a] / root, block.mu);
  }
  return {plain.relative(), scaled.relative()};
}

NlgsReport solve_nlgs(const DelassusProblem& problem, const NlgsOptions& options, std::span<double> r) {
  std::vector<double> u(r.size()), best(r.begin(), r.end());
  NlgsReport report;
  report.error = delassus_error(problem, r, u);
  report.history.push_back({0, report.error});
  report.converged = report.error.siconos <= options.tolerance;
  std::int64_t next_check = 1;
  while (!report.converged && report.iterations < options.max_iterations) {
    report.failed_contacts = sweep(problem, r);
    ++report.iterations;
    if (report.iterations < next_check && report.iterations < options.max_iterations) continue;
    next_check = report.iterations + std::clamp<std::int64_t>(report.iterations / 10, 1, 50);

    const DelassusError error = delassus_error(problem, r, u);
    report.history.push_back({report.iterations, error});
    if (error.siconos < report.error.siconos) {
      report.error = error;
      std::copy(r.begin(), r.end(), best.begin());
    }
    report.converged = error.siconos <= options.tolerance;
    if (options.stop && options.stop()) break;
  }
  std::copy(best.begin(), best.end(), r.begin());
  return report;
}

}  // namespace talus
