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

/// The plain sweep and, after the first one, the damped one.
class DampedSweep {
 public:
  DampedSweep(const DelassusProblem& problem, std::span<const double> weight, double damping)
      : problem_(problem), weight_(weight), damping_(damping), sweep_(problem) {}
  /// r in place; returns the number of contacts whose law had no solution.
  std::int64_t operator()(std::span<double> r) {
    // The first sweep is not damped: contacts that do not touch each other are then solved at once.
    if (++sweeps_ == 2 && damping_ > 0)
      sweep_ = ProximalSweep(problem_, damping_of({weight_.begin(), weight_.end()}, damping_));
    return sweep_(r, r);
  }

 private:
  const DelassusProblem& problem_;
  std::span<const double> weight_;
  double damping_;
  ProximalSweep sweep_;
  std::int64_t sweeps_ = 0;
};

/// Sweeps over a problem until its goal is reached, with checks of the error now and then.
class CheckedSweeps {
 public:
  /// `answer` has not reached the goal yet.
  CheckedSweeps(const DelassusProblem& problem, const DelassusGoal& goal, double damping, BestAnswer& answer)
      : goal_(goal), answer_(answer), weight_(weights_of(problem)), sweep_(problem, weight_, damping) {}

  /// D_c, one per contact.
  std::span<const double> weight() const { return weight_; }
  bool done() const {
    const DelassusReport& report = answer_.report();
    return report.converged || report.stopped || report.iterations >= goal_.max_iterations;
  }
  /// Number of the last sweep that a check found better than all before; 0: none.
  std::int64_t best_iteration() const { return best_iteration_; }

  /// One sweep, from `start` to `r`; true when its error was checked.
  bool operator()(std::span<const double> start, std::span<double> r) {
    DelassusReport& report = answer_.report();
    std::copy(start.begin(), start.end(), r.begin());
    report.failed_contacts = sweep_(r);
    ++report.iterations;
    report.stopped = goal_.stop && goal_.stop();
    if (report.iterations < next_check_ && report.iterations != goal_.max_iterations && !report.stopped)
      return false;
    next_check_ = report.iterations + check_interval(report.iterations);
    if (answer_.offer(report.iterations, r)) best_iteration_ = report.iterations;
    return true;
  }

 private:
  const DelassusGoal& goal_;
  BestAnswer& answer_;
  std::vector<double> weight_;
  DampedSweep sweep_;
  std::int64_t next_check_ = 1, best_iteration_ = 0;
};

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
    for (std::size_t c = 0; c < weight.size(); ++c) {
      for (std::size_t k = 3 * c; k < 3 * c + 3; ++k) {
        const double back = start[k] - r[k];
        turned_back += weight[c] * back * (r[k] - previous[k]);
        step += weight[c] * back * back;
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
    for (std::size_t k = 0; k < r.size(); ++k) {
      start[k] = r[k] + factor * (r[k] - previous[k]);
      previous[k] = r[k];
    }
  }

 private:
  double limit_ = 1, t_ = 1;
  double last_step_ = std::numeric_limits<double>::infinity();  ///< squared
};

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

DelassusReport solve_nlgs(const DelassusProblem& problem, const DelassusGoal& goal,
                          const SweepSettings& settings, std::span<double> r) {
  BestAnswer answer(problem, goal, r);
  if (answer.done()) return answer.hand_back();
  DelassusReport& report = answer.report();
  std::vector<double> start(r.begin(), r.end()), previous(start);
  CheckedSweeps sweep(problem, goal, settings.damping, answer);
  Momentum momentum;
  momentum.restart(settings.momentum);
  const auto begin_anew = [&](double most_momentum) {
    momentum.restart(most_momentum);
    start.assign(answer.best().begin(), answer.best().end());
    previous = start;
  };
  std::int64_t intervened = 0, rescued = 0;  // iterations
  while (!sweep.done()) {
    const bool checked = sweep(start, r);
    if (report.converged || report.stopped) break;
    if (checked && settings.intervene && settings.intervene(answer)) {
      intervened = report.iterations;
      begin_anew(settings.momentum);
      continue;
    }
    const std::int64_t improved = std::max(sweep.best_iteration(), intervened);
    if (report.iterations - std::max(improved, rescued) > std::max<std::int64_t>(1000, improved)) {
      constexpr double limits[] = {1, 0.9, 0};
      begin_anew(std::min(settings.momentum, limits[++report.rescues % 3]));
      rescued = report.iterations;
    } else {
      momentum.advance(r, sweep.weight(), previous, start);
    }
  }
  return answer.hand_back();
}

DelassusReport solve_nncg(const DelassusProblem& problem, const DelassusGoal& goal, double damping,
                          std::span<double> r) {
  BestAnswer answer(problem, goal, r);
  if (answer.done()) return answer.hand_back();
  std::vector<double> start(r.begin(), r.end()), direction(r.size(), 0.0);
  CheckedSweeps sweep(problem, goal, damping, answer);
  const std::span<const double> weight = sweep.weight();
  double last = std::numeric_limits<double>::infinity();
  while (!sweep.done()) {
    sweep(start, r);
    double squared = 0;
    for (std::size_t k = 0; k < r.size(); ++k)
      squared += weight[k / 3] * (start[k] - r[k]) * (start[k] - r[k]);
    const bool anew = !(last > 0) || squared > last;  // a sweep that changed nothing has no direction
    const double beta = anew ? 0 : squared / last;
    last = squared;
    for (std::size_t k = 0; k < r.size(); ++k) {
      const double gradient = start[k] - r[k];
      start[k] = r[k] + beta * direction[k];
      direction[k] = anew ? 0 : beta * direction[k] - gradient;
    }
  }
  return answer.hand_back();
}

}  // namespace talus
