#include "apps/study_error/study_runs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "apps/shared/median.hpp"
#include "runtime/step/decomposition.hpp"
#include "runtime/step/methods/method.hpp"
#include "runtime/step/simulation.hpp"

namespace talus {

namespace {

using Say = std::function<void(const std::string&)>;
using Curve = std::vector<std::array<double, 2>>;
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// What a run left.
struct Outcome {
  Curve stress;         ///< time [s], q/p; empty when the walls close no box
  std::vector<Vec3> x;  ///< in order of id
  Domain domain;        ///< where they stand
  double time = 0, seconds = 0, last_step = 0;
  std::int64_t steps = 0, sweeps = 0, missed = 0;
};

Outcome run_once(const StudySample& sample, const StudyPlan& plan, const StudyVariant& variant,
                 double tolerance, double time_step) {
  Setup setup = sample.scene.setup;
  const double duration = static_cast<double>(plan.steps) * setup.stages.front().time_step;
  for (Stage& stage : setup.stages) {
    stage.time_step *= time_step;
    if (stage.end.steps.value_or(0) > 0)
      stage.end.steps =
          std::max<std::int64_t>(1, std::llround(static_cast<double>(*stage.end.steps) / time_step));
  }
  setup.decomposition = with_subdomains(setup.decomposition, variant.subdomains);
  setup.solver = at_tolerance(setup.solver, tolerance);
  setup.solver.method = methods().named(variant.method).kind;
  graph::Executor executor({.threads = variant.threads});
  Simulation simulation(setup, sample.bodies, executor);
  Outcome out;
  while (!simulation.finished() && out.time < duration - 0.5 * simulation.stage().time_step) {
    const StepReport& report = simulation.step();
    out.last_step = simulation.stage().time_step;
    out.time = report.time;
    out.steps = report.step;
    out.sweeps += report.iterations;
    out.seconds += report.wall_s;
    if (!report.converged) ++out.missed;
    if (const auto triaxial = simulation.triaxial()) out.stress.push_back({report.time, triaxial->q_over_p});
    simulation.begin_next_stage();
  }
  Frame last = simulation.frame(false);
  out.x = std::move(last.x);
  out.domain = last.domain;
  return out;
}

/// Linear between the points, constant beyond them. `curve` is not empty.
double value_at(const Curve& curve, double time) {
  const auto after = std::ranges::lower_bound(curve, time, {}, [](const auto& p) { return p[0]; });
  if (after == curve.begin()) return curve.front()[1];
  if (after == curve.end()) return curve.back()[1];
  const auto& before = *(after - 1);
  return before[1] + (time - before[0]) / ((*after)[0] - before[0]) * ((*after)[1] - before[1]);
}

double rms_difference(const Curve& curve, const Curve& reference) {
  if (curve.empty() || reference.empty()) return nan;
  double sum = 0;
  for (const auto& [time, value] : curve) {
    const double difference = value - value_at(reference, time);
    sum += difference * difference;
  }
  return std::sqrt(sum / static_cast<double>(curve.size()));
}

double position_error(const Outcome& run, const Outcome& reference, const Bodies& bodies) {
  if (std::abs(run.time - reference.time) > 0.51 * std::max(run.last_step, reference.last_step) ||
      bodies.size() == 0)
    return nan;
  double diameter = 0;
  for (double radius : bodies.radius) diameter += 2 * radius / static_cast<double>(bodies.size());
  return rms_distance(run.x, reference.x, reference.domain) / diameter;
}

}  // namespace

double rms_distance(std::span<const Vec3> x, std::span<const Vec3> reference, const Domain& domain) {
  double sum = 0;
  const auto count = static_cast<double>(x.size());
  for (std::size_t k = 0; k < x.size(); ++k)
    sum += domain.separation(x[k], reference[k]).squaredNorm() / count;
  return std::sqrt(sum);
}

std::string why_no_step(const io::Scene& scene, const StudyPlan& plan, double time_step) {
  const std::vector<Stage>& stages = scene.setup.stages;
  if (time_step > static_cast<double>(plan.steps))
    return fmt::format(
        "--time-steps {:g}: a run of {} steps of the scene has no step that long; raise --steps", time_step,
        plan.steps);
  for (const Stage& stage : stages)
    if (stage.chooses_time_step)
      return fmt::format(
          "stage '{}' chooses its time steps, so that there is none to multiply by --time-steps; give one by "
          "--set time_step=H, or leave the whole runs out by --only step",
          stage.name);
  for (const Stage& stage : stages)
    if (stage.end.time && steps_in(*stage.end.time, time_step * stage.time_step) < 1)
      return fmt::format(
          "--time-steps {:g}: stage '{}' ends after {:g} s, no more than half a step of {:g} s; choose a "
          "smaller factor",
          time_step, stage.name, *stage.end.time, time_step * stage.time_step);
  return "";
}

void study_runs(const StudySample& sample, const StudyPlan& plan, const Say& say,
                const std::function<void()>& keep, RunStudy& study) {
  const std::uint64_t seed = sample.scene.setup.seed;
  RunReference& row = study.references.emplace_back();
  StudyVariant finest{.method = "auto", .subdomains = 1, .threads = 1, .seed = seed};
  for (const StudyVariant& variant : plan.variants)
    finest.threads = std::max(finest.threads, variant.threads);
  row.seed = seed;
  row.tolerance = 0.1 * plan.tolerances.back();
  row.time_step = plan.time_steps.back();
  StudySample patient = sample;
  patient.scene.setup.solver = at_tolerance(patient.scene.setup.solver, plan.tolerances.back());
  patient.scene.setup.solver.max_iterations *= 4;
  const Outcome reference = run_once(patient, plan, finest, row.tolerance, row.time_step);
  row.steps = reference.steps;
  row.missed = reference.missed;
  row.time = reference.time;
  row.seconds = reference.seconds;
  study.curves.push_back(reference.stress);
  say(fmt::format("reference run, seed {}: tolerance {:.1e}, {:g} x time step, {} steps, {:.3g} s{}", seed,
                  row.tolerance, row.time_step, row.steps, row.seconds,
                  row.missed > 0 ? fmt::format("; {} steps missed the tolerance", row.missed) : ""));
  for (const StudyVariant& variant : plan.variants) {
    if (variant.seed != seed) continue;
    for (const double time_step : plan.time_steps)
      for (const double tolerance : plan.tolerances) {
        const std::string name = fmt::format("run with {}, tolerance {:.1e}, {:g} x time step",
                                             label_of(variant, plan.variants), tolerance, time_step);
        try {
          const Outcome run = run_once(sample, plan, variant, tolerance, time_step);
          std::vector<double> seconds{run.seconds};
          while (run.seconds < cheap_solve && seconds.size() < 3)
            seconds.push_back(run_once(sample, plan, variant, tolerance, time_step).seconds);
          study.rows.push_back({variant, tolerance, time_step, run.steps, run.sweeps, run.missed,
                                median(seconds), rms_difference(run.stress, reference.stress),
                                position_error(run, reference, sample.bodies)});
          const RunRow& done = study.rows.back();
          const auto off = [](const char* what, double error, const char* unit) {
            return std::isnan(error) ? "" : fmt::format(", {} off by {:.1e}{}", what, error, unit);
          };
          say(fmt::format("{}: {} sweeps, {:.3g} s{}{}{}", name, done.sweeps, done.seconds,
                          off("q/p", done.stress_error, ""), off("positions", done.position_error, " d"),
                          done.missed > 0 ? fmt::format(", {} steps missed", done.missed) : ""));
        } catch (const std::exception& error) {
          say(fmt::format("{} failed: {}", name, error.what()));
          continue;
        }
        keep();
      }
  }
}

double scatter_of_seeds(const RunStudy& study) {
  double sum = 0, pairs = 0;
  for (std::size_t a = 0; a < study.curves.size(); ++a)
    for (std::size_t b = 0; b < a; ++b) {
      const double difference = rms_difference(study.curves[a], study.curves[b]);
      sum += difference * difference;
      ++pairs;
    }
  return pairs > 0 ? std::sqrt(sum / pairs) : nan;
}

}  // namespace talus
