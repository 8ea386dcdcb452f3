#include "kernels/delassus/delassus_sweeps.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace talus {
namespace {

using ConstVec3 = Eigen::Map<const Vec3>;

/// D_c, trace(W_cc)/3 where that is positive.
double mean_diagonal(const LocalBlock& block) {
  return std::max(0.0, block.W.trace() / 3);
}

std::vector<double> weights_of(const DelassusProblem& p) {
  std::vector<double> weight;
  weight.reserve(p.contacts());
  for (const LocalBlock& own : p.diagonal) weight.push_back(mean_diagonal(own));
  return weight;
}

std::vector<double> damping_of(std::vector<double> weight, double damping) {
  for (double& w : weight) w *= damping;
  return weight;
}

/// Sweeps between two checks of the error.
std::int64_t check_interval(std::int64_t sweeps) {
  return std::clamp<std::int64_t>(sweeps / 10, 1, 50);
}

}  // namespace

ProximalSweep::ProximalSweep(const DelassusProblem& problem, std::span<const double> hold)
    : problem_(&problem), hold_(hold.begin(), hold.end()) {
  block_.reserve(problem.contacts());
  for (std::size_t a = 0; a < problem.contacts(); ++a) {
    const LocalBlock& own = problem.diagonal[a];
    block_.push_back(local_block(own.W + hold_[a] * Mat3::Identity(), own.mu));
  }
}

std::int64_t ProximalSweep::operator()(std::span<const double> centre, std::span<double> r) const {
  const DelassusProblem& p = *problem_;
  const std::span<const LocalBlock> blocks = block_.empty() ? p.diagonal : block_;
  std::int64_t failed = 0;
  for (std::size_t a = 0; a < p.contacts(); ++a) {
    Vec3 q = velocity_from_others(p, r, a);
    if (!hold_.empty()) q -= hold_[a] * ConstVec3(centre.data() + 3 * a);
    Eigen::Map<Vec3> own(r.data() + 3 * a);
    const LocalSolution s = solve_local(blocks[a], q, own);
    own = s.r;
    failed += s.status == LocalStatus::failed;
  }
  return failed;
}

SweepIteration::SweepIteration(const DelassusProblem& problem, Start start, const SweepSettings& settings,
                               std::span<const double> r)
    : problem_(problem),
      kind_(start),
      settings_(settings),
      weight_(weights_of(problem)),
      sweep_(problem),
      r_(r.begin(), r.end()),
      limit_(settings.momentum) {
  begin_from(r);
}

void SweepIteration::begin_from(std::span<const double> r) {
  start_.assign(r.begin(), r.end());
  t_ = 1;
  last_step_ = std::numeric_limits<double>::infinity();
  if (kind_ == Start::momentum)
    previous_ = start_;
  else
    previous_.assign(r.size(), 0.0);
}

void SweepIteration::iterate(BestAnswer& answer) {
  std::copy(start_.begin(), start_.end(), r_.begin());
  // The first sweep is not damped: contacts that do not touch each other are then solved at once.
  if (++sweeps_ == 2 && settings_.damping > 0)
    sweep_ = ProximalSweep(problem_, damping_of(weight_, settings_.damping));
  answer.report().failed_contacts = sweep_(r_, r_);
  progress_.spend(sweep_cost(problem_));
  if (answer.count() || sweeps_ >= next_check_) {
    next_check_ = sweeps_ + check_interval(sweeps_);
    if (answer.offer(answer.report().iterations, r_)) best_sweep_ = sweeps_;
    progress_.spend(check_cost(problem_));
    progress_.check(answer.last());
    if (answer.over()) return;
  }
  if (kind_ == Start::conjugate)
    advance_conjugate();
  else if (sweeps_ - std::max(best_sweep_, rescued_) > std::max<std::int64_t>(1000, best_sweep_))
    rescue(answer);
  else
    advance();
}

void SweepIteration::rescue(BestAnswer& answer) {
  constexpr double limits[] = {1, 0.9, 0};
  limit_ = std::min(settings_.momentum, limits[++answer.report().rescues % 3]);
  rescued_ = sweeps_;
  begin_from(answer.best());
}

void SweepIteration::advance() {
  double turned_back = 0, step = 0;
  for (std::size_t c = 0; c < weight_.size(); ++c) {
    for (std::size_t k = 3 * c; k < 3 * c + 3; ++k) {
      const double back = start_[k] - r_[k];
      turned_back += weight_[c] * back * (r_[k] - previous_[k]);
      step += weight_[c] * back * back;
    }
  }
  const double t = 0.5 * (1 + std::sqrt(1 + 4 * t_ * t_));
  double factor = std::min(limit_, (t_ - 1) / t);
  t_ = t;
  if (turned_back > 0 || step > 2 * last_step_) {
    factor = 0;
    t_ = 1;
  }
  last_step_ = step;
  for (std::size_t k = 0; k < r_.size(); ++k) {
    start_[k] = r_[k] + factor * (r_[k] - previous_[k]);
    previous_[k] = r_[k];
  }
}

void SweepIteration::advance_conjugate() {
  std::vector<double>& direction = previous_;
  double squared = 0;
  for (std::size_t k = 0; k < r_.size(); ++k)
    squared += weight_[k / 3] * (start_[k] - r_[k]) * (start_[k] - r_[k]);
  const bool anew =
      !(last_step_ > 0) || squared > last_step_;  // a sweep that changed nothing has no direction
  const double beta = anew ? 0 : squared / last_step_;
  last_step_ = squared;
  for (std::size_t k = 0; k < r_.size(); ++k) {
    const double gradient = start_[k] - r_[k];
    start_[k] = r_[k] + beta * direction[k];
    direction[k] = anew ? 0 : beta * direction[k] - gradient;
  }
}

DelassusReport solve_nlgs(const DelassusProblem& problem, const DelassusGoal& goal,
                          const SweepSettings& settings, std::span<double> r) {
  BestAnswer answer(problem, goal, r);
  SweepIteration sweeps(problem, SweepIteration::Start::momentum, settings, r);
  while (!answer.over()) sweeps.iterate(answer);
  answer.report().work = sweeps.progress().work();
  return answer.hand_back();
}

DelassusReport solve_nncg(const DelassusProblem& problem, const DelassusGoal& goal, double damping,
                          std::span<double> r) {
  BestAnswer answer(problem, goal, r);
  SweepIteration sweeps(problem, SweepIteration::Start::conjugate, {.damping = damping}, r);
  while (!answer.over()) sweeps.iterate(answer);
  answer.report().work = sweeps.progress().work();
  return answer.hand_back();
}

double sweep_cost(std::size_t blocks, std::size_t contacts) {
  return 9.0 * static_cast<double>(blocks) + 150.0 * static_cast<double>(contacts);
}

double sweep_cost(const DelassusProblem& problem) {
  return sweep_cost(problem.column.size(), problem.contacts());
}

double check_cost(const DelassusProblem& problem) {
  return 9.0 * static_cast<double>(problem.column.size()) + 100.0 * static_cast<double>(problem.contacts());
}

}  // namespace talus
