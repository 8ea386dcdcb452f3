#include "kernels/delassus/delassus_admm.hpp"

#include <algorithm>
#include <cmath>

#include "kernels/delassus/detail/block_factorisation.hpp"

namespace talus {
namespace {

using Vector = Eigen::VectorXd;

/// Whether W is symmetric to rounding: the block at (b, a) is the transpose of that at (a, b).
bool is_symmetric(const DelassusProblem& p) {
  constexpr double rounding = 1e-12;  // of the unit diagonal
  for (std::size_t a = 0; a < p.contacts(); ++a) {
    if (!(p.diagonal[a].W - p.diagonal[a].W.transpose()).isZero(rounding)) return false;
    for (auto k = p.row_begin[a]; k < p.row_begin[a + 1]; ++k) {
      const auto b = static_cast<std::size_t>(p.column[static_cast<std::size_t>(k)]);
      const auto first = p.column.begin() + p.row_begin[b], last = p.column.begin() + p.row_begin[b + 1];
      const auto found = std::lower_bound(first, last, static_cast<std::int32_t>(a));
      const Mat3& block = p.block[static_cast<std::size_t>(k)];
      if (found == last || *found != static_cast<std::int32_t>(a)) {
        if (!block.isZero(rounding)) return false;
      } else if (!(block - p.block[static_cast<std::size_t>(found - p.column.begin())].transpose())
                      .isZero(rounding)) {
        return false;
      }
    }
  }
  return true;
}

class ShiftedMatrix {
 public:
  explicit ShiftedMatrix(const DelassusProblem& p)
      : p_(p), order_(detail::elimination_order(p)), place_(p.contacts()), definite_(is_symmetric(p)) {
    for (std::size_t k = 0; k < order_.size(); ++k)
      place_[static_cast<std::size_t>(order_[k])] = static_cast<std::int32_t>(k);
  }

  /// Factorises W + rho I.
  bool factorise(double rho) {
    std::vector<detail::BlockEntry> entries;
    entries.reserve(p_.contacts() + p_.column.size());
    for (std::size_t a = 0; a < p_.contacts(); ++a) {
      entries.push_back({place_[a], place_[a], p_.diagonal[a].W + rho * Mat3::Identity()});
      for (auto k = static_cast<std::size_t>(p_.row_begin[a]);
           k < static_cast<std::size_t>(p_.row_begin[a + 1]); ++k)
        entries.push_back({place_[a], place_[static_cast<std::size_t>(p_.column[k])], p_.block[k]});
    }
    return factors_.factorise(p_.contacts(), entries, definite_);
  }

  void solve(const Vector& rhs, Vector& x) {
    work_.resize(rhs.size());
    for (std::size_t a = 0; a < place_.size(); ++a)
      work_.segment<3>(3 * place_[a]) = rhs.segment<3>(static_cast<Eigen::Index>(3 * a));
    factors_.solve(work_);
    for (std::size_t a = 0; a < place_.size(); ++a)
      x.segment<3>(static_cast<Eigen::Index>(3 * a)) = work_.segment<3>(3 * place_[a]);
  }

 private:
  const DelassusProblem& p_;
  std::vector<std::int32_t> order_, place_;
  bool definite_;
  detail::BlockFactorisation factors_;
  Vector work_;
};

}  // namespace

DelassusReport solve_admm(const DelassusProblem& problem, const DelassusGoal& goal,
                          const AdmmSettings& settings, std::span<double> r) {
  BestAnswer answer(problem, goal, r);
  if (answer.done() || problem.contacts() == 0) return answer.hand_back();
  DelassusReport& report = answer.report();
  const UnitDiagonal scaled = unit_diagonal(problem);
  const DelassusProblem& p = scaled.problem;
  const auto size = static_cast<Eigen::Index>(r.size());
  Vector z(size), lambda(size), x(size), rhs(size), relaxed(size), old(size);
  std::vector<double> candidate(r.size());
  for (std::size_t k = 0; k < r.size(); ++k) z[static_cast<Eigen::Index>(k)] = r[k] * scaled.root[k / 3];
  relative_velocity(p, {z.data(), r.size()}, {lambda.data(), r.size()});
  for (std::size_t c = 0; c < p.contacts(); ++c) {
    auto l = lambda.segment<3>(static_cast<Eigen::Index>(3 * c));
    l = -de_saxce_velocity(l, p.diagonal[c].mu);
  }

  double rho = settings.penalty;
  ShiftedMatrix matrix(p);
  bool regular = matrix.factorise(rho);
  ++report.factorisations;
  std::int64_t next_check = 1, next_change = 20;
  while (regular && !report.converged && !report.stopped && report.iterations < goal.max_iterations) {
    for (std::size_t c = 0; c < p.contacts(); ++c) {
      const auto row = static_cast<Eigen::Index>(3 * c);
      rhs.segment<3>(row) = rho * z.segment<3>(row) - lambda.segment<3>(row) - p.q[c];
      rhs[row] -= p.diagonal[c].mu * lambda.segment<2>(row + 1).norm();
    }
    matrix.solve(rhs, x);
    relaxed = settings.over_relaxation * x + (1 - settings.over_relaxation) * z;
    old = z;
    for (std::size_t c = 0; c < p.contacts(); ++c) {
      const auto row = static_cast<Eigen::Index>(3 * c);
      const Vec3 at = relaxed.segment<3>(row) + lambda.segment<3>(row) / rho;
      const Vec3 projected = project_on_cone(at, p.diagonal[c].mu);
      z.segment<3>(row) = projected;
      lambda.segment<3>(row) = rho * (at - projected);
    }
    ++report.iterations;
    report.stopped = goal.stop && goal.stop();
    if (report.iterations >= next_check || report.stopped || report.iterations == goal.max_iterations) {
      next_check = report.iterations + std::clamp<std::int64_t>(report.iterations / 10, 1, 20);
      for (std::size_t k = 0; k < candidate.size(); ++k)
        candidate[k] = z[static_cast<Eigen::Index>(k)] / scaled.root[k / 3];
      answer.offer(report.iterations, candidate);
    }
    if (report.iterations >= next_change) {
      // Residual balancing (Boyd et al. 2011, 3.4.1), ever more seldom, so that the method still converges.
      next_change = 2 * report.iterations;
      const double primal = (x - z).norm(), dual = rho * (z - old).norm();
      const double ratio = dual > 0 ? primal / dual : 1;
      if (ratio > 5 || ratio < 0.2) {
        rho *= std::clamp(std::sqrt(ratio), 0.05, 20.0);
        regular = matrix.factorise(rho);
        ++report.factorisations;
      }
    }
  }
  return answer.hand_back();
}

}  // namespace talus
