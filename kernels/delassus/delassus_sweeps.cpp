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
  const std::vector<double> weight = weights_of(problem);
  std::vector<double> start(r.begin(), r.end()), previous(start);
  DampedSweep sweep(problem, weight, settings.damping);
  Momentum momentum;
  momentum.restart(settings.momentum);
  std::int64_t next_check = 1, best_iteration = 0, phase_begin = 0;
  while (!report.converged && !report.stopped && report.iterations < goal.max_iterations) {
    std::copy(start.begin(), start.end(), r.begin());
    report.failed_contacts = sweep(r);
    ++report.iterations;
    report.stopped = goal.stop && goal.stop();
    if (report.iterations >= next_check || report.iterations == goal.max_iterations || report.stopped) {
      next_check = report.iterations + check_interval(report.iterations);
      if (answer.offer(report.iterations, r)) best_iteration = report.iterations;
      if (report.converged || report.stopped) break;
      if (settings.intervene && settings.intervene(answer)) {
        best_iteration = report.iterations;
        momentum.restart(settings.momentum);
        start.assign(answer.best().begin(), answer.best().end());
        previous = start;
        continue;
      }
    }
    if (report.iterations - std::max(best_iteration, phase_begin) >
        std::max<std::int64_t>(1000, best_iteration)) {
      constexpr double limits[] = {1, 0.9, 0};
      momentum.restart(std::min(settings.momentum, limits[++report.rescues % 3]));
      phase_begin = report.iterations;
      start.assign(answer.best().begin(), answer.best().end());
      previous = start;
    } else {
      momentum.advance(r, weight, previous, start);
    }
  }
  return answer.hand_back();
}

DelassusReport solve_nncg(const DelassusProblem& problem, const DelassusGoal& goal, double damping,
                          std::span<double> r) {
  BestAnswer answer(problem, goal, r);
  if (answer.done()) return answer.hand_back();
  DelassusReport& report = answer.report();
  const std::vector<double> weight = weights_of(problem);
  std::vector<double> start(r.begin(), r.end()), direction(r.size(), 0.0);
  DampedSweep sweep(problem, weight, damping);
  double last = std::numeric_limits<double>::infinity();
  std::int64_t next_check = 1;
  while (!report.converged && !report.stopped && report.iterations < goal.max_iterations) {
    std::copy(start.begin(), start.end(), r.begin());
    report.failed_contacts = sweep(r);
    ++report.iterations;
    report.stopped = goal.stop && goal.stop();
    if (report.iterations >= next_check || report.iterations == goal.max_iterations || report.stopped) {
      next_check = report.iterations + check_interval(report.iterations);
      answer.offer(report.iterations, r);
    }
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
