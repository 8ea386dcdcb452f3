#include "apps/study_error/study_problem.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <stdexcept>

#include "apps/shared/median.hpp"
#include "runtime/step/decomposition.hpp"
#include "runtime/step/methods/method.hpp"
#include "runtime/step/simulation.hpp"

namespace talus {

namespace {

using Say = std::function<void(const std::string&)>;

/// Velocities of all grains in order of id, times the roots of their masses and moments of inertia: the
/// Euclidean norm is the kinetic one.
using Motion = std::vector<double>;

Motion motion_of(const Frame& frame, const std::map<std::int64_t, double>& mass) {
  Motion motion;
  motion.reserve(6 * frame.id.size());
  for (std::size_t k = 0; k < frame.id.size(); ++k) {
    const double m = mass.at(frame.id[k]);
    for (double u : frame.u[k]) motion.push_back(std::sqrt(m) * u);
    if (frame.omega.empty()) continue;
    const double inertia = 0.4 * m * frame.radius[k] * frame.radius[k];
    for (double omega : frame.omega[k]) motion.push_back(std::sqrt(inertia) * omega);
  }
  return motion;
}

double distance(const Motion& a, const Motion& b) {
  return std::sqrt(std::transform_reduce(a.begin(), a.end(), b.begin(), 0.0, std::plus<>(),
                                         [](double x, double y) { return (x - y) * (x - y); }));
}

/// One solve of the step.
struct Solve {
  std::vector<ErrorCheck> history;
  StepReport report;
  double seconds = 0;  ///< of the iterations
  Motion motion;
  std::vector<Vec3> wall_forces;
  double push = 0;  ///< sum of the forces that walls are pushed with [N]
};

/// The step that is solved again and again.
class Problem {
 public:
  Problem(const StudySample& sample, const StudyPlan& plan, int threads)
      : plan_(plan), setup_(sample.scene.setup) {
    Setup alone = setup_;
    alone.decomposition = with_subdomains(alone.decomposition, 1);
    graph::Executor executor({.threads = threads});
    Simulation simulation(alone, sample.bodies, executor);
    while (!simulation.finished() && simulation.report().step < plan.at_step) {
      simulation.step();
      simulation.begin_next_stage();
    }
    if (simulation.finished())
      throw std::runtime_error(fmt::format(
          "{}: the scene ends after step {}, so there is no step to solve behind step {}; choose a "
          "smaller --at-step",
          sample.scene.source_file, simulation.report().step, plan.at_step));
    saved_ = simulation.save();
    if (saved_.bodies.size() == 0)
      throw std::runtime_error(fmt::format(
          "{}: there are no grains behind step {}, and so nothing to solve; choose a larger --at-step",
          sample.scene.source_file, plan.at_step));
    // The step is solved without the grains that come and go with it, but looks as far as with them.
    setup_.detection.alert = simulation.parameters().alert;
    setup_.detection.skin = simulation.parameters().skin;
    setup_.inserts.clear();
    setup_.removes.clear();
    saved_.population = {};
    for (std::size_t k = 0; k < saved_.bodies.size(); ++k) {
      mass_[static_cast<std::int64_t>(saved_.bodies.id[k])] = saved_.bodies.mass(k);
      total_mass_ += saved_.bodies.mass(k);
    }
    before_ = simulation.frame(false);
    gravity_ = simulation.parameters().gravity;
    setup_.solver = at_tolerance(setup_.solver, plan.tolerances.back());
  }

  /// To the smallest tolerance of the plan.
  const SolverSettings& solver() const { return setup_.solver; }

  /// `solver`: to what tolerance; the method is the variant's. Throws RunawayError when the iterations
  /// diverge, and what else Simulation throws.
  Solve solve(const StudyVariant& variant, bool warm, int sweeps, const SolverSettings& solver,
              graph::Executor& executor) const {
    Setup setup = setup_;
    setup.decomposition = with_subdomains(setup.decomposition, variant.subdomains);
    setup.solver = solver;
    setup.solver.method = methods().named(variant.method).kind;
    setup.solver.warm_start = warm;
    setup.solver.max_iterations = sweeps;
    Simulation simulation(setup, saved_, executor);
    Solve solve;
    solve.report = simulation.step();
    solve.history = simulation.error_history();
    solve.seconds = simulation.sums().times.iteration;
    solve.motion = motion_of(simulation.frame(false), mass_);
    for (const WallReport& wall : simulation.walls()) solve.wall_forces.push_back(wall.force);
    for (const WallState& wall : simulation.state().wall_states) solve.push += std::abs(wall.applied);
    return solve;
  }

  /// The motion without the impulses of a step of `time_step` [s].
  Motion free_motion(double time_step) const {
    Frame free = before_;
    for (Vec3& u : free.u) u += time_step * gravity_;
    return motion_of(free, mass_);
  }
  /// Kinetic norm of the motion that an impulse [N s] gives to all grains as one body.
  double motion_by(double impulse) const { return impulse / std::sqrt(total_mass_); }
  std::int64_t bodies() const { return static_cast<std::int64_t>(mass_.size()); }
  const StudyPlan& plan() const { return plan_; }

 private:
  const StudyPlan& plan_;
  Setup setup_;
  SavedState saved_;
  Frame before_;                         ///< the beginning of the step
  Vec3 gravity_ = Vec3::Zero();          ///< [m/s^2]
  std::map<std::int64_t, double> mass_;  ///< by id
  double total_mass_ = 0;                ///< of the grains [kg]
};

/// What the others are compared with.
struct Reference {
  Motion motion;
  double scale = 0;  ///< of velocities, kinetic norm
  std::vector<Vec3> wall_forces;
  double force_scale = 0;

  double velocity_error(const Solve& solve) const {
    const double difference = distance(solve.motion, motion);
    return difference == 0 ? 0 : difference / scale;
  }
  double wall_force_error(const Solve& solve) const {
    if (wall_forces.empty()) return std::numeric_limits<double>::quiet_NaN();
    double worst = 0;
    for (std::size_t w = 0; w < wall_forces.size(); ++w)
      worst = std::max(worst, (solve.wall_forces[w] - wall_forces[w]).norm());
    return worst == 0 ? 0 : worst / force_scale;
  }
};

/// How far a solve missed what was asked of it: the larger of its errors over their tolerances.
double excess(const StepReport& report, const SolverSettings& asked) {
  return std::max(report.error_rms / asked.tolerance, report.balance / asked.balance_tolerance);
}

/// Solves a hundred times tighter than anybody else, with ten times as many sweeps: with the first method
/// that gets there, else with the one that comes nearest.
Reference solve_reference(const Problem& problem, int threads, const Say& say, ProblemReference& row) {
  const StudyPlan& plan = problem.plan();
  const SolverSettings solver = at_tolerance(problem.solver(), 0.01 * plan.tolerances.back());
  row.tolerance = solver.tolerance;
  row.balance_tolerance = solver.balance_tolerance;
  std::vector<std::string> methods{"auto"};
  for (const StudyVariant& variant : plan.variants)
    if (std::ranges::find(methods, variant.method) == methods.end()) methods.push_back(variant.method);
  std::optional<Solve> best;
  for (const std::string& method : methods) {
    try {
      graph::Executor executor({.threads = threads});
      Solve solve = problem.solve({.method = method}, true, 10 * plan.max_sweeps, solver, executor);
      if (solve.report.converged || !best || excess(solve.report, solver) < excess(best->report, solver)) {
        row.method = method;
        best = std::move(solve);
      }
    } catch (const std::exception& error) {
      say(fmt::format("reference with {} failed: {}", method, error.what()));
    }
    if (best && best->report.converged) break;
  }
  if (!best) throw RunawayError("no method solved the reference");
  row.sweeps = best->report.iterations;
  row.error_rms = best->report.error_rms;
  row.balance = best->report.balance;
  row.contacts = best->report.contacts;
  row.step = best->report.step;
  row.converged = best->report.converged;
  row.bodies = problem.bodies();
  const std::string wanted = fmt::format(" (wanted {:.1e} and {:.1e}: errors near it mean little)",
                                         row.tolerance, row.balance_tolerance);
  say(
      fmt::format("reference of step {}: {} grains, {} contacts, {} with {} sweeps: residual {:.1e}, balance "
                  "{:.1e}{}",
                  row.step, row.bodies, row.contacts, row.method, row.sweeps, row.error_rms, row.balance,
                  row.converged ? "" : wanted));
  if (row.contacts == 0)
    say("warning: that step has no contacts, so that methods have nothing to solve: take a later one with "
        "--at-step");
  Reference reference;
  for (const Vec3& force : best->wall_forces)
    reference.force_scale = std::max(reference.force_scale, force.norm());
  // Grains pressed at rest neither move nor gain: what the walls are pushed with is the measure then. What
  // walls answer with is none, where something else is: in a narrow wedge it is any multiple of the load.
  const double h = best->report.time_step, answer = problem.motion_by(h * reference.force_scale);
  reference.scale =
      std::max({distance(best->motion, Motion(best->motion.size(), 0.0)),
                distance(best->motion, problem.free_motion(h)), problem.motion_by(h * best->push)});
  constexpr double rounding = 1e-9;
  if (reference.scale <= rounding * answer) reference.scale = answer;
  reference.motion = std::move(best->motion);
  reference.wall_forces = std::move(best->wall_forces);
  return reference;
}

/// A solve, timed as often as is cheap; its times are medians. Solves need not be alike where space is cut by
/// measured time: a check's time is that of those that have it.
Solve timed(const Problem& problem, const StudyVariant& variant, bool warm, int sweeps,
            graph::Executor& executor) {
  std::vector<Solve> solves;
  solves.push_back(problem.solve(variant, warm, sweeps, problem.solver(), executor));
  while (solves.front().seconds < cheap_solve && solves.size() < 3)
    solves.push_back(problem.solve(variant, warm, sweeps, problem.solver(), executor));
  Solve middle = solves.front();
  std::vector<double> seconds;
  for (const Solve& solve : solves) seconds.push_back(solve.seconds);
  middle.seconds = median(seconds);
  for (std::size_t k = 0; k < middle.history.size(); ++k) {
    seconds.clear();
    for (const Solve& solve : solves)
      if (k < solve.history.size() && solve.history[k].iterations == middle.history[k].iterations)
        seconds.push_back(solve.history[k].seconds);
    middle.history[k].seconds = median(seconds);
  }
  return middle;
}

}  // namespace

void study_problem(const StudySample& sample, const StudyPlan& plan, const Say& say,
                   const std::function<void()>& keep, ProblemStudy& study) {
  const std::uint64_t seed = sample.scene.setup.seed;
  int most_threads = 1;
  for (const StudyVariant& variant : plan.variants) most_threads = std::max(most_threads, variant.threads);
  if (plan.at_step > 0) say(fmt::format("seed {}: {} steps to the problem", seed, plan.at_step));
  const Problem problem(sample, plan, most_threads);
  ProblemReference& row = study.references.emplace_back();
  row.seed = seed;
  const Reference reference = solve_reference(problem, most_threads, say, row);
  for (const StudyVariant& variant : plan.variants) {
    if (variant.seed != seed) continue;
    for (const bool warm : {false, true}) {
      if (warm && plan.at_step == 0) continue;  // there are no impulses yet
      Solve last;
      const std::string name =
          fmt::format("{}, {}", label_of(variant, plan.variants), warm ? "warm" : "cold");
      try {
        graph::Executor executor({.threads = variant.threads});
        for (int sweeps = std::min(10, plan.max_sweeps);; sweeps = std::min(2 * sweeps, plan.max_sweeps)) {
          last = timed(problem, variant, warm, sweeps, executor);
          study.truth.push_back({variant, warm, last.report.iterations, last.seconds, last.report.error_rms,
                                 reference.velocity_error(last), reference.wall_force_error(last),
                                 last.report.converged});
          const bool stopped = last.report.iterations < sweeps || last.report.converged;
          if (stopped || sweeps == plan.max_sweeps || 2 * last.seconds > plan.max_seconds) break;
        }
      } catch (const std::exception& error) {
        say(fmt::format("{} failed: {}", name, error.what()));
      }
      for (const ErrorCheck& check : last.history)
        study.residual.push_back({variant, warm, check.iterations, check.seconds, check.error_rms});
      if (!last.history.empty())
        say(fmt::format("{}: {} sweeps, {:.3g} s, residual {:.1e}, velocity error {:.1e}, wall forces {:.1e}",
                        name, last.report.iterations, last.seconds, last.report.error_rms,
                        study.truth.back().velocity_error, study.truth.back().wall_force_error));
      keep();
    }
  }
}

}  // namespace talus
