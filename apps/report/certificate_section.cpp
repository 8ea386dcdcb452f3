/// May it be believed: error, balance and overlap of every step, with their tolerances.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/report/sections.hpp"

namespace talus {

namespace {

constexpr std::size_t colour_of_error = 0, colour_of_missed = 6;

io::HtmlFigure figure_of(const io::Chart& chart, std::string caption) {
  return {.svg = io::draw_chart(chart), .caption = std::move(caption)};
}

/// A number of each step over time with what it may be, and the steps that exceed it.
struct Bounded {
  const char *title, *label, *column;
  double tolerance;
  std::string caption;
};

io::HtmlFigure bounded_figure(const RunFolder& run, const Bounded& what) {
  const auto& time = run.steps["time"];
  // What is far below its tolerance, as before grains touch, would press the rest of the curve flat.
  constexpr double floor = 1e-4;
  std::vector<double> value = run.steps[what.column];
  for (double& v : value)
    if (v < floor * what.tolerance) v = floor * what.tolerance;
  io::Chart chart = small_chart(what.title, "time [s]", what.label, true);
  chart.series.push_back({"", thinned(time, value, Thinned::largest), colour_of_error});
  std::vector<double> missed_time, missed;
  for (std::size_t k = 0; k < value.size() && what.tolerance > 0; ++k)
    if (value[k] > what.tolerance) missed_time.push_back(time[k]), missed.push_back(value[k]);
  if (!missed.empty()) {
    chart.series.front().name = "all steps";
    chart.series.push_back({fmt::format("beyond its tolerance: {}", missed.size()),
                            thinned(missed_time, missed, Thinned::largest), colour_of_missed, 0, true});
  }
  if (what.tolerance > 0)
    chart.levels.push_back({what.tolerance, fmt::format("tolerance {:g}", what.tolerance)});
  return figure_of(chart, what.caption);
}

std::string verdict(const RunFolder& run, std::size_t steps, std::size_t missed) {
  std::string text = certificate_sentence(steps, missed);
  if (missed == 0) return text;
  const auto &time = run.steps["time"], &converged = run.steps["converged"];
  std::string first, last;
  for (std::size_t k = 0; k < converged.size(); ++k)
    if (converged[k] == 0) {
      last = fmt::format("{:.4g} s", time[k]);
      if (first.empty()) first = last;
    }
  text += first == last ? fmt::format(" It ended at {}. ", first)
                        : fmt::format(" The first ended at {}, the last at {}. ", first, last);
  return text +
         "The column `converged` of steps.csv names each; worst_* and overlap_* name its worst contact and "
         "bodies.";
}

/// The loosest bound of any stage; 0 where it is not known, or none holds: with friction more is told than
/// what steps are swept for.
double velocity_allowed(const RunFolder& run) {
  if (!run.scene) return 0;
  const Setup& setup = run.scene->setup;
  const bool friction = std::ranges::any_of(
      setup.stages, [](const Stage& stage) { return stage.laws.largest(&PairLaw::friction) > 0; });
  if (friction && setup.solver.velocity_tolerance == 0) return 0;
  return setup.solver.velocity_allowed(friction);
}

}  // namespace

std::string certificate_sentence(std::size_t steps, std::size_t missed) {
  if (steps == 0) return "No step has ended.";
  if (missed == 0) return fmt::format("All {} steps are within their tolerances.", steps);
  return fmt::format("{} of {} steps missed a tolerance.", missed, steps);
}

HtmlSections certificate_section(const RunFolder& run) {
  const auto& converged = run.steps["converged"];
  if (converged.empty()) return {};
  const SolverSettings solver = run.scene ? run.scene->setup.solver : SolverSettings{};
  const auto missed = static_cast<std::size_t>(std::count(converged.begin(), converged.end(), 0.0));
  io::HtmlSection section{"May it be believed?", verdict(run, converged.size(), missed)};
  for (const std::string& finding : sentences_of(run, "findings"))
    section.table.rows.push_back({"warning", finding});
  section.text +=
      " Where steps are many, the worst of each stretch is drawn; what is below a ten-thousandth of its "
      "tolerance is drawn there.";
  section.figures = {
      bounded_figure(run,
                     {"Error of the contacts", "error, rms", "error_rms", run.scene ? solver.tolerance : 0,
                      "How far contacts are from Signorini's and Coulomb's laws: the natural map, rms over "
                      "all contacts, over the velocity scale of the step."}),
      bounded_figure(
          run, {"Error of the worst contact", "error, largest", "error_max",
                run.scene ? solver.worst_allowed() : 0, "The same of the contact that is furthest off."}),
      bounded_figure(
          run, {"Balance of forces", "balance", "balance", run.scene ? solver.balance_tolerance : 0,
                "Estimated error of the forces on walls and heavy bodies and through any cut, or defect of "
                "momentum, whichever is larger."}),
      bounded_figure(run, {"Overlap", "overlap", "overlap", run.scene ? solver.overlap_tolerance : 0,
                           "Largest overlap at the end of the step, beyond those that the sample began with, "
                           "over the smaller radius of the pair."})};
  const auto& velocity_error = run.steps["velocity_error"];
  if (std::ranges::any_of(velocity_error, [](double e) { return e > 0; }))
    section.figures.push_back(bounded_figure(
        run,
        {"Error of velocities", "error, velocities", "velocity_error", velocity_allowed(run),
         "In clusters of contacts that are too large for a direct solve: estimated momentum of the errors "
         "of velocities, over what these contacts exchange; with friction over the largest impulse of a "
         "wall, if that is less, often ten times too large, and no bound unless velocity_tolerance is set. "
         "1 says that nothing is known."}));
  return {section};
}

}  // namespace talus
