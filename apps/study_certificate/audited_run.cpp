#include "apps/study_certificate/audited_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>

#include "runtime/step/simulation.hpp"

namespace talus::audit {

namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Momentum that may be unexplained, see disagreement().
constexpr double rounding = 1e-6;

/// A reference has to be known to this part of what the step claims.
constexpr double sharpness = 0.1;

/// Of what is asked for: what the law may leave, and what velocities may be off by, where forces are compared
/// (ReferenceLimits::forces). The step before has left the gaps uncertain by a hundred times as much.
constexpr double slack_of_law = 1e-2, slack_of_velocities = 1e-1;

/// Of wedges in which a grain is in both sides: the narrowest that it still moves out of, as 1 over the
/// cosine of half the angle of the normals, and how far at most. Narrower ones, as above and below in a
/// column, no grain gets out of by itself.
constexpr double narrowest = 1000, farthest_out = 40;

/// Where a contact has its grain, as a side of a wedge.
struct Side {
  double sign = 0;        ///< of the normal that points into the grain; 0: it is no side of that grain
  bool overlaps = false;  ///< else what is granted reaches it
};

Side side_of(const StepProblem& problem, const StepContact& contact, std::size_t grain, double granted) {
  if (contact.is_moment() || contact.bias * problem.time_step > granted) return {};
  if (contact.first == grain) return {1, contact.bias <= 0};
  return {!contact.at_wall() && contact.other() == grain ? -1.0 : 0.0, contact.bias <= 0};
}

/// How far a grain may have to go for each overlap that is undone: two sides whose normals are an angle a
/// apart let go by 1 as it moves by 1/cos(a/2). One side may be open at first, by no more than `granted` [m],
/// which a grain between walls that are far apart may go.
double way_out(const StepProblem& problem, double granted) {
  double most = 1;
  const auto& contacts = problem.contacts;
  for (std::size_t c = 0; c < contacts.size(); ++c)
    for (std::size_t d = 0; d < c; ++d)
      for (const std::size_t grain : {contacts[c].first, contacts[d].first}) {
        const Side one = side_of(problem, contacts[c], grain, granted);
        const Side other = side_of(problem, contacts[d], grain, granted);
        const double both = one.sign * other.sign;
        if (both == 0 || !(one.overlaps || other.overlaps)) continue;
        const double half =
            std::sqrt(std::max(0.0, (1 + both * contacts[c].normal.dot(contacts[d].normal)) / 2));
        if (half * narrowest >= 1) most = std::max(most, std::min(1 / half, farthest_out));
      }
  return most;
}

/// What a step begins from.
struct Start {
  Frame before;
  std::vector<Wall> walls;
  Stage stage;
  std::size_t stage_index;
};

Start start_of(const Simulation& simulation) {
  return {simulation.frame(false), simulation.state().walls, simulation.stage(), simulation.stage_index()};
}

/// In the terms of the problem: with Moreau's law it is one of mean velocities, (V + E V-)/(1 + E).
Frame mean_of_impact(double E, const Frame& before, const Frame& after, const CellEnd& cell) {
  Frame mean = after;
  for (std::size_t k = 0; k < mean.u.size(); ++k)
    mean.u[k] = cell.u.empty() ? Vec3((after.u[k] + E * before.u[k]) / (1 + E)) : cell.u[k];
  for (std::size_t w = 0; w < mean.walls.size(); ++w)
    mean.walls[w].velocity = (after.walls[w].velocity + E * before.walls[w].velocity) / (1 + E);
  return mean;
}

void judge(const StepProblem& problem, const Start& start, const Frame& after, const ReferenceLimits& limits,
           AuditedStep& step) {
  step.contacts = std::ranges::count(problem.contacts, false, &StepContact::is_moment);
  step.smooth = problem.smooth();
  std::size_t clusters = 0;
  clusters_of(problem, clusters);
  step.clusters = static_cast<std::int64_t>(clusters);
  const RunImpulses run = impulses_of(problem, after);
  CellEnd cell;
  if (problem.cell.repeats)
    cell = end_in_cell(problem.cell, start.stage.time_step, problem.reflection, start.before, after);
  const Frame mean = mean_of_impact(problem.reflection, start.before, after, cell);
  const std::vector<Vec3> spins = spins_at_end(problem, after);
  std::vector<double> speeds;
  for (std::size_t k = 0; k < after.u.size(); ++k)
    speeds.push_back(start.before.u[k].norm() + after.u[k].norm());
  const StepEnd end{mean, run.r, cell.gained, spins, speeds, step.claimed};
  step.unexplained = disagreement(problem, end);
  if (run.unknown > 0 || !(step.unexplained <= rounding)) {
    step.judged = Judged::other_problem;
    step.why = fmt::format("{} contacts unknown to the audit, momentum unexplained {:.1e}", run.unknown,
                           step.unexplained);
    return;
  }
  if (!step.shift.within(1) && !step.shift.within(way_out(problem, step.shift.granted))) {
    step.judged = Judged::other_problem;
    step.why = fmt::format("a grain is {:.1e} times as far as velocities and overlaps take it",
                           step.shift.way / step.shift.granted);
    return;
  }
  ReferenceLimits own = limits;
  own.forces = slack_of_law * step.asked;
  own.forces_velocities = slack_of_velocities * step.asked;
  own.own_velocities = step.asked;
  const Reference reference = solve_reference(problem, run.r, own);
  step.residual = reference.residual;
  step.uncertainty = reference.uncertainty();
  step.why = reference.why;
  if (reference.found == Found::no_answer) step.judged = Judged::no_answer;
  if (reference.found > Found::velocities) return;
  step.errors = true_errors(problem, reference, end, felt_rounding(problem, reference, step.claimed, own));
  step.errors.energy = energy_gain(problem, start.before, after);
  step.forces_known = reference.found == Found::answer;
  const bool sharp = step.uncertainty <= sharpness * step.claimed;
  step.judged = sharp ? Judged::yes : Judged::no_reference;
  if (!sharp) step.why = fmt::format("known to {:.1e} only", step.uncertainty);
}

}  // namespace

bool AuditedRun::gave_up() const {
  if (ended.empty() || !of_run || steps.empty()) return false;
  return no_space || !steps.back().certified || steps.back().overlapping;
}

AuditedRun audit_run(const io::Scene& scene, const Bodies& bodies, const AuditPlan& plan,
                     const std::function<bool(const AuditedStep&)>& goes_on) {
  AuditedRun run;
  try {
    const SolverSettings& solver = scene.setup.solver;
    graph::Executor executor({.threads = 1});
    Simulation simulation(scene.setup, bodies, executor);
    double stage_began = 0;
    std::vector<double> stage_times;
    while (!simulation.finished() && static_cast<std::int64_t>(run.steps.size()) < plan.steps) {
      Start start = start_of(simulation);
      if (simulation.steps_of_stage() == 0) {
        stage_times.resize(start.stage_index, start.before.time - stage_began);
        stage_began = start.before.time;
      }
      const auto run_start = Clock::now();
      run.of_run = true;
      const StepReport& report = simulation.step();
      run.of_run = false;
      AuditedStep step;
      step.run_seconds = seconds_since(run_start);
      start.stage.time_step = report.time_step;  // of stages that choose that of each step
      step.step = report.step;
      step.certified = report.converged;
      step.overlapping = !(report.overlap <= scene.setup.solver.overlap_tolerance);
      step.error_rms = report.error_rms;
      step.balance = report.balance;
      step.iterations = report.iterations;
      step.claimed = std::max({report.error_rms, report.balance, report.velocity_error, solver.tolerance});
      step.asked = std::max(solver.tolerance, solver.balance_tolerance);
      const auto audit_start = Clock::now();
      const Frame after = simulation.frame();
      std::vector<double> loads;
      for (const WallState& wall : simulation.state().wall_states) loads.push_back(wall.applied);
      const StepInput input{start.before,
                            start.walls,
                            loads,
                            start.stage,
                            bodies,
                            scene.setup,
                            start.stage_index,
                            start.before.time - stage_began,
                            stage_times,
                            &after};
      const StepProblem problem = rebuild_step(input);
      step.shift = unexplained_shift(input, solver.overlap_correction, after);
      judge(problem, start, after, plan.limits, step);
      if (report.velocity_error >= CertificateThresholds{}.all_wrong && step.judged == Judged::yes) {
        step.judged = Judged::no_reference;
        step.why = "the step claims nothing";
      }
      step.audit_seconds = seconds_since(audit_start);
      run.steps.push_back(std::move(step));
      if (goes_on && !goes_on(run.steps.back())) break;
      run.of_run = true;
      simulation.begin_next_stage();
    }
  } catch (const NoSpaceError& error) {
    run.ended = error.what();
    run.no_space = true;
  } catch (const std::exception& error) {
    run.ended = error.what();
  }
  return run;
}

}  // namespace talus::audit
