#include "kernels/delassus/delassus_solve.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "kernels/delassus/delassus_admm.hpp"
#include "kernels/delassus/delassus_sweeps.hpp"
#include "kernels/delassus/newton.hpp"

namespace talus {
namespace {

constexpr std::pair<DelassusMethod, std::string_view> names[] = {
    {DelassusMethod::nlgs, "nlgs"},     {DelassusMethod::nlgs_momentum, "nlgs+momentum"},
    {DelassusMethod::nncg, "nncg"},     {DelassusMethod::admm, "admm"},
    {DelassusMethod::newton, "newton"}, {DelassusMethod::automatic, "auto"},
};

/// When the sweeps of `automatic` let Newton try.
class NewtonTrials {
 public:
  NewtonTrials(const DelassusProblem& problem, const DelassusGoal& goal) : problem_(problem), goal_(goal) {}

  /// SweepSettings::intervene.
  bool operator()(BestAnswer& answer) {
    if (answer.report().failed_contacts > 0) return false;
    const double sweeps = static_cast<double>(answer.report().iterations);
    if (sweeps < next_trial_) return false;
    if (step_cost_ == 0) {
      // Only now: small tolerances often are met before this is worth finding out.
      step_cost_ = newton_cost(problem_) / sweep_cost(problem_);
      next_trial_ = 4 * step_cost_;
      if (sweeps < next_trial_) return false;
    }
    // Sweeps that have not made the error a third while they doubled have stalled.
    const bool stalled = last_error_ > 0 && answer.least() > 0.3 * last_error_;
    const bool helped =
        newton(answer, stalled ? patience_ : 2, static_cast<std::int64_t>(0.5 * sweeps / step_cost_));
    if (stalled && !helped) patience_ *= 4;
    last_error_ = answer.least();
    next_trial_ = 2 * sweeps;
    return helped;
  }

 private:
  bool newton(BestAnswer& answer, int patience, std::int64_t steps) {
    DelassusReport& report = answer.report();
    DelassusGoal goal = goal_;
    goal.max_iterations = std::min(steps, goal_.max_iterations - report.iterations);
    std::vector<double> r(answer.best().begin(), answer.best().end());
    const DelassusReport part = solve_newton(problem_, goal, {.patience = patience}, r);
    report.iterations += part.iterations;
    report.factorisations += part.factorisations;
    report.stopped = part.stopped;
    return answer.offer(report.iterations, r);
  }

  const DelassusProblem& problem_;
  const DelassusGoal& goal_;
  double next_trial_ = 40;  ///< [sweeps]
  double step_cost_ = 0;    ///< of a step of Newton [sweeps]
  double last_error_ = 0;   ///< after the last trial
  int patience_ = 6;        ///< with Newton, where sweeps have stalled: its way down may lead up first
};

}  // namespace

std::string_view name_of(DelassusMethod method) {
  for (const auto& [of, name] : names)
    if (of == method) return name;
  return "";
}

std::optional<DelassusMethod> delassus_method(std::string_view name) {
  for (const auto& [method, of] : names)
    if (of == name) return method;
  return std::nullopt;
}

DelassusReport solve_delassus(const DelassusProblem& problem, DelassusMethod method, const DelassusGoal& goal,
                              std::span<double> r) {
  switch (method) {
    case DelassusMethod::nlgs:
      return solve_nlgs(problem, goal, {.momentum = 0}, r);
    case DelassusMethod::nlgs_momentum:
      return solve_nlgs(problem, goal, {}, r);
    case DelassusMethod::nncg:
      return solve_nncg(problem, goal, SweepSettings{}.damping, r);
    case DelassusMethod::admm:
      return solve_admm(problem, goal, {}, r);
    case DelassusMethod::newton:
      return solve_newton(problem, goal, {}, r);
    case DelassusMethod::automatic:
      break;
  }
  NewtonTrials trials(problem, goal);
  return solve_nlgs(problem, goal, {.intervene = std::ref(trials)}, r);
}

}  // namespace talus
