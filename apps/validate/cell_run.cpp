#include "apps/validate/cell_run.hpp"

#include <fmt/format.h>
#include <algorithm>

#include <cmath>
#include <numbers>

#include "apps/shared/patience.hpp"
#include "kernels/samples/scatter.hpp"
#include "runtime/graph/one_rank.hpp"
#include "runtime/step/cell_flow.hpp"
#include "runtime/step/dealing.hpp"

namespace talus::literature {

namespace {

/// Numbers of the runs that no case varies.
struct CellRunParameters {
  /// Solid fraction of the random places that a sample is made of, in (0, 0.35].
  double loose = 0.3;
  /// Of a step in inertial times, > 0: a grain that is let go falls by a thousandth of its diameter.
  double time_step = 0.03;
  /// Shear of a step, at most: fast flows take shorter steps ...
  double strain_of_step = 1e-3;
  /// ... and at least: flows slower than this over `time_step` take longer ones.
  double least_strain_of_step = 5e-6;
  /// Steps from row to row.
  std::int64_t every = 10;
};
constexpr CellRunParameters parameters;

void take_stress(Stage& stage) {
  for (std::size_t k = 0; k < 3; ++k) stage.stress.to[k] = 1;
}

}  // namespace

Stage press_stage(double friction, double rest, double most) {
  Stage stage;
  stage.name = "press";
  stage.time_step = parameters.time_step;
  stage.laws.set_all(&PairLaw::friction, friction);
  take_stress(stage);
  stage.end.time = most;
  stage.end.equilibrium = rest;
  return stage;
}

Stage shear_stage(double friction, double rate, double strain) {
  Stage stage;
  stage.name = "shear";
  stage.time_step = std::clamp(parameters.time_step, parameters.least_strain_of_step / rate,
                               parameters.strain_of_step / rate);
  stage.laws.set_all(&PairLaw::friction, friction);
  take_stress(stage);
  stage.shear_rates = {0, rate, 0};
  stage.end.shear_strain = strain;
  return stage;
}

Stage triaxial_stage(double friction, double rate, double strain) {
  Stage stage = shear_stage(friction, rate, 1);
  stage.name = "triaxial";
  stage.shear_rates.setZero();
  stage.strain_rates = {0, 0, -rate};
  stage.stress.to[2].reset();
  stage.end = {};
  stage.end.strain = strain;
  return stage;
}

StepCount run_to_end(const Setup& setup, Sample sample, int threads,
                     const std::function<void(const Simulation&)>& look) {
  graph::Executor executor({.threads = threads});
  const graph::Communicator& alone = graph::one_rank();
  Simulation simulation(setup, deal_out(std::move(sample), setup.decomposition, alone), executor, alone);
  StepCount count;
  for (; !simulation.finished(); simulation.begin_next_stage()) {
    ++count.steps;
    if (!simulation.step().converged) ++count.missed;
    look(simulation);
  }
  return count;
}

CellRun run_cell(const CellPlan& plan) {
  Sample sample;
  sample.density = 1;
  for (std::size_t k = 0; k < static_cast<std::size_t>(plan.grains); ++k)
    sample.radius.push_back(plan.radii[k % plan.radii.size()]);
  Setup setup;
  double cubes = 0;
  for (const double radius : plan.radii)
    cubes += std::pow(2 * radius, 3) / static_cast<double>(plan.radii.size());
  const double volume = static_cast<double>(plan.grains) * std::numbers::pi / 6 * cubes;
  const double width = std::cbrt(volume / parameters.loose / plan.slender);
  setup.domain = periodic_domain({width, width, plan.slender * width});
  setup.stages = plan.stages;
  setup.solver.tolerance = plan.effort.tolerance;
  setup.solver.balance_tolerance = std::min(setup.solver.balance_tolerance, 50 * plan.effort.tolerance);
  setup.solver.direct_bodies = 0;  // small samples as large ones are, by estimates: averages are asked for
  setup.decomposition.coupling = Coupling::nscdd;
  setup.decomposition.subdomains = 1;
  sample.x =
      scatter(sample.radius, {.high = setup.domain.edges(), .domain = setup.domain, .seed = plan.seed});
  CellRun run;
  Patience patience(stderr, std::chrono::seconds(5), std::chrono::seconds(15));
  double sheared = 0;
  std::size_t stage = 0;
  const StepCount count =
      run_to_end(setup, std::move(sample), plan.effort.threads, [&](const Simulation& simulation) {
        if (simulation.stage_index() != stage) sheared = 0;
        stage = simulation.stage_index();
        const StepReport& report = simulation.report();
        sheared += report.time_step * shear_rate(gradient_before(simulation.state().domain, 0));
        const bool ends = simulation.stage_fraction() >= 1;
        if (report.step % parameters.every == 0 || ends) {
          run.rows.push_back(simulation.cell().value());
          run.sheared.push_back(sheared);
        }
        if (ends) run.last = simulation.frame();
        patience.tell([&] {
          return fmt::format("  {} grains, seed {}, {} {:.0f} %", plan.grains, plan.seed,
                             simulation.stage().name, 100 * simulation.stage_fraction());
        });
      });
  run.steps = count.steps;
  run.missed = count.missed;
  return run;
}

Mean mean_of(std::span<const double> numbers) {
  Mean mean;
  const auto count = static_cast<double>(numbers.size());
  for (const double number : numbers) mean.value += number / count;
  double squares = 0;
  for (const double number : numbers) squares += (number - mean.value) * (number - mean.value);
  if (numbers.size() > 1) mean.error = std::sqrt(squares / (count - 1) / count);
  return mean;
}

double mean_over(const CellRun& run, const std::string& stage, double from,
                 const std::function<double(const CellReport&)>& of) {
  double sum = 0, count = 0;
  for (std::size_t k = 0; k < run.rows.size(); ++k) {
    if (run.rows[k].stage != stage || run.sheared[k] < from) continue;
    sum += of(run.rows[k]);
    count += 1;
  }
  return count > 0 ? sum / count : std::nan("");
}

const CellReport& last_of(const CellRun& run, const std::string& stage) {
  const auto found = std::find_if(run.rows.rbegin(), run.rows.rend(),
                                  [&](const CellReport& row) { return row.stage == stage; });
  return found == run.rows.rend() ? run.rows.back() : *found;
}

}  // namespace talus::literature
