#include "kernels/delassus/delassus_admm.hpp"

#include <algorithm>
#include <cmath>

#include "kernels/delassus/delassus_sweeps.hpp"

namespace talus {
namespace {

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

}  // namespace

detail::ShiftedMatrix::ShiftedMatrix(const DelassusProblem& problem, std::span<const std::int32_t> order)
    : p_(problem), place_(problem.contacts()), definite_(is_symmetric(problem)) {
  for (std::size_t k = 0; k < order.size(); ++k)
    place_[static_cast<std::size_t>(order[k])] = static_cast<std::int32_t>(k);
}

bool detail::ShiftedMatrix::factorise(double rho) {
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

void detail::ShiftedMatrix::solve(const Eigen::VectorXd& rhs, Eigen::VectorXd& x) {
  work_.resize(rhs.size());
  for (std::size_t a = 0; a < place_.size(); ++a)
    work_.segment<3>(3 * place_[a]) = rhs.segment<3>(static_cast<Eigen::Index>(3 * a));
  factors_.solve(work_);
  for (std::size_t a = 0; a < place_.size(); ++a)
    x.segment<3>(static_cast<Eigen::Index>(3 * a)) = work_.segment<3>(3 * place_[a]);
}

AdmmIteration::AdmmIteration(const detail::FactorisedForm& form, const AdmmSettings& settings,
                             std::span<const double> r)
    : form_(form),
      settings_(settings),
      matrix_(form.scaled.problem, form.order),
      z_(static_cast<Eigen::Index>(r.size())),
      lambda_(z_.size()),
      x_(z_.size()),
      rhs_(z_.size()),
      relaxed_(z_.size()),
      old_(z_.size()),
      candidate_(r.size()),
      rho_(settings.penalty) {
  begin_from(r);
}

void AdmmIteration::begin_from(std::span<const double> r) {
  const DelassusProblem& p = form_.scaled.problem;
  for (std::size_t k = 0; k < r.size(); ++k)
    z_[static_cast<Eigen::Index>(k)] = r[k] * form_.scaled.root[k / 3];
  relative_velocity(p, {z_.data(), r.size()}, {lambda_.data(), r.size()});
  for (std::size_t c = 0; c < p.contacts(); ++c) {
    auto l = lambda_.segment<3>(static_cast<Eigen::Index>(3 * c));
    l = -de_saxce_velocity(l, p.diagonal[c].mu);
  }
}

void AdmmIteration::factorise(BestAnswer& answer) {
  regular_ = matrix_.factorise(rho_);
  ++answer.report().factorisations;
  progress_.spend(form_.factorisation_cost());
}

void AdmmIteration::iterate(BestAnswer& answer) {
  if (iterations_ == 0) factorise(answer);
  if (!regular_) return;
  const DelassusProblem& p = form_.scaled.problem;
  for (std::size_t c = 0; c < p.contacts(); ++c) {
    const auto row = static_cast<Eigen::Index>(3 * c);
    rhs_.segment<3>(row) = rho_ * z_.segment<3>(row) - lambda_.segment<3>(row) - p.q[c];
    rhs_[row] -= p.diagonal[c].mu * lambda_.segment<2>(row + 1).norm();
  }
  matrix_.solve(rhs_, x_);
  relaxed_ = settings_.over_relaxation * x_ + (1 - settings_.over_relaxation) * z_;
  old_ = z_;
  for (std::size_t c = 0; c < p.contacts(); ++c) {
    const auto row = static_cast<Eigen::Index>(3 * c);
    const Vec3 at = relaxed_.segment<3>(row) + lambda_.segment<3>(row) / rho_;
    const Vec3 projected = project_on_cone(at, p.diagonal[c].mu);
    z_.segment<3>(row) = projected;
    lambda_.segment<3>(row) = rho_ * (at - projected);
  }
  ++iterations_;
  progress_.spend(matrix_.solve_cost());
  if (answer.count() || iterations_ >= next_check_) {
    next_check_ = iterations_ + std::clamp<std::int64_t>(iterations_ / 10, 1, 20);
    for (std::size_t k = 0; k < candidate_.size(); ++k)
      candidate_[k] = z_[static_cast<Eigen::Index>(k)] / form_.scaled.root[k / 3];
    answer.offer(answer.report().iterations, candidate_);
    progress_.spend(check_cost(p));
    progress_.check(answer.last());
  }
  if (iterations_ >= next_change_) balance(answer);
}

void AdmmIteration::balance(BestAnswer& answer) {
  next_change_ = 2 * iterations_;
  const double primal = (x_ - z_).norm(), dual = rho_ * (z_ - old_).norm();
  const double ratio = dual > 0 ? primal / dual : 1;
  if (ratio > 5 || ratio < 0.2) {
    rho_ *= std::clamp(std::sqrt(ratio), 0.05, 20.0);
    factorise(answer);
  }
}

DelassusReport solve_admm(const DelassusProblem& problem, const DelassusGoal& goal,
                          const AdmmSettings& settings, std::span<double> r) {
  BestAnswer answer(problem, goal, r);
  if (answer.over() || problem.contacts() == 0) return answer.hand_back();
  const detail::FactorisedForm form(problem);
  AdmmIteration admm(form, settings, r);
  while (!answer.over() && admm.regular()) admm.iterate(answer);
  answer.report().work = detail::analysis_cost(problem) + admm.progress().work();
  return answer.hand_back();
}

double admm_cost(const DelassusProblem& problem) {
  const auto n = static_cast<double>(problem.contacts());
  return n <= static_cast<double>(detail::dense_contacts) ? 4.5 * n * n + 100 * n : 3 * sweep_cost(problem);
}

}  // namespace talus
