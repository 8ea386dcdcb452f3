#include "kernels/delassus.hpp"

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

/// q_a + sum of W_ab r_b over b != a: what the others do to contact a. 9 doubles and 18 flops a block.
Vec3 velocity_from_others(const DelassusProblem& p, std::span<const double> r, std::size_t a) {
  Vec3 u = p.q[a];
  for (std::int64_t k = p.row_begin[a]; k < p.row_begin[a + 1]; ++k) {
    const auto place = static_cast<std::size_t>(k);
    u += p.block[place] * at(r, static_cast<std::size_t>(p.column[place]));
  }
  return u;
}

/// What of the blocks the damped law needs.
struct DampedBlocks {
  std::vector<LocalBlock> block;  ///< W_cc + hold I
  std::vector<double> hold;       ///< damping D_c [1/kg]
};

/// D_c, trace(W_cc)/3 where that is positive.
double mean_diagonal(const LocalBlock& block) {
  return std::max(0.0, block.W.trace() / 3);
}

DampedBlocks damped_blocks(const DelassusProblem& p, double damping) {
  DampedBlocks d;
  d.block.reserve(p.contacts());
  d.hold.reserve(p.contacts());
  for (const LocalBlock& own : p.diagonal) {
    d.hold.push_back(damping * mean_diagonal(own));
    d.block.push_back(local_block(own.W + d.hold.back() * Mat3::Identity(), own.mu));
  }
  return d;
}

/// One sweep; returns the number of contacts whose law had no solution.
std::int64_t sweep(const DelassusProblem& p, const DampedBlocks& damped, std::span<double> r) {
  std::int64_t failed = 0;
  for (std::size_t a = 0; a < p.contacts(); ++a) {
    const Vec3 old = at(r, a);
    const Vec3 q = velocity_from_others(p, r, a) - damped.hold[a] * old;
    const LocalSolution s = solve_local(damped.block[a], q, old);
    put(r, a, s.r);
    failed += s.status == LocalStatus::failed;
  }
  return failed;
}

/// Nesterov's momentum for a fixed-point iteration, with its two reasons to begin anew.
class Momentum {
 public:
  /// Forgets the past; no factor above `limit` from now on.
  void restart(double limit) {
    limit_ = limit;
    t_ = 1;
    last_step_ = std::numeric_limits<double>::infinity();
  }

  /// Turns `start` (where the sweep began) into the start of the next one. `r`: what the sweep made of it;
  /// `previous`: the result of the sweep before, replaced by r. `weight`: D_c, one per contact.
  void advance(std::span<const double> r, std::span<const double> weight, std::span<double> previous,
               std::span<double> start) {
    double turned_back = 0, step = 0;
    for (std::size_t k = 0; k < r.size(); ++k) {
      const double back = start[k] - r[k];
      turned_back += weight[k / 3] * back * (r[k] - previous[k]);
      step += weight[k / 3] * back * back;
    }
    const double t = 0.5 * (1 + std::sqrt(1 + 4 * t_ * t_));
    double factor = std::min(limit_, (t_ - 1) / t);
    t_ = t;
    if (turned_back > 0 || step > 2 * last_step_) {
      factor = 0;
      t_ = 1;
    }
    last_step_ = step;
    for (std::size_t k = 0; k < r.size(); ++k) {
      start[k] = r[k] + factor * (r[k] - previous[k]);
      previous[k] = r[k];
    }
  }

 private:
  double limit_ = 1, t_ = 1;
  double last_step_ = std::numeric_limits<double>::infinity();  ///< squared
};

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
  std::vector<double> u(r.size()), best(r.begin(), r.end()), start(best), previous(best), weight;
  for (const LocalBlock& block : problem.diagonal) weight.push_back(mean_diagonal(block));
  NlgsReport report;
  report.error = delassus_error(problem, r, u);
  report.history.push_back({0, report.error});
  report.converged = report.error.siconos <= options.tolerance;

  // The first sweep is not damped: contacts that do not touch each other are then solved at once.
  DampedBlocks blocks{problem.diagonal, std::vector<double>(problem.contacts(), 0.0)};
  Momentum momentum;
  momentum.restart(options.momentum);
  bool stopped = false;
  std::int64_t next_check = 1, best_iteration = 0, phase_begin = 0;
  while (!report.converged && !stopped && report.iterations < options.max_iterations) {
    std::copy(start.begin(), start.end(), r.begin());
    report.failed_contacts = sweep(problem, blocks, r);
    if (++report.iterations == 1 && options.damping > 0) blocks = damped_blocks(problem, options.damping);
    stopped = options.stop && options.stop();

    if (report.iterations >= next_check || report.iterations == options.max_iterations || stopped) {
      next_check = report.iterations + std::clamp<std::int64_t>(report.iterations / 10, 1, 50);
      const DelassusError error = delassus_error(problem, r, u);
      report.history.push_back({report.iterations, error});
      if (error.siconos < report.error.siconos) {
        report.error = error;
        best_iteration = report.iterations;
        std::copy(r.begin(), r.end(), best.begin());
      }
      report.converged = error.siconos <= options.tolerance;
    }

    if (report.iterations - std::max(best_iteration, phase_begin) >
        std::max<std::int64_t>(1000, best_iteration)) {
      constexpr double limits[] = {1, 0.9, 0};
      momentum.restart(std::min(options.momentum, limits[++report.rescues % 3]));
      phase_begin = report.iterations;
      start = best;
      previous = best;
    } else {
      momentum.advance(r, weight, previous, start);
    }
  }
  std::copy(best.begin(), best.end(), r.begin());
  return report;
}

}  // namespace talus
