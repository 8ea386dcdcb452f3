#include "apps/study_error/study_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string_view>

#include "io/files/csv_table.hpp"
#include "io/files/output_directory.hpp"
#include "runtime/step/methods/method.hpp"

namespace talus {

namespace {

/// Place of `value` in `seen`, where it is put if it is new.
template <class T>
std::size_t place_in(std::vector<T>& seen, const T& value) {
  const auto found = std::ranges::find(seen, value);
  const auto place = static_cast<std::size_t>(found - seen.begin());
  if (found == seen.end()) seen.push_back(value);
  return place;
}

const char* start_of(bool warm) {
  return warm ? "warm" : "cold";
}

/// The same colour for a method in all pictures.
template <class Names>
std::size_t hue_of(const std::string& method, const Names& names) {
  return static_cast<std::size_t>(std::ranges::find(names, method) - names.begin());
}

/// Rows that follow one another and belong to one curve become a series: colour by method, dashes by the
/// rest. `rest(row)` is the text of the latter, "" for nothing to say; `point(row)` the point.
template <class Row, class Rest, class PointOf>
std::vector<io::ChartSeries> series_of(const std::vector<Row>& rows, Rest rest, PointOf point) {
  std::vector<io::ChartSeries> all;
  const std::vector<std::string> known = talus::methods().names();
  std::vector<std::string> rests;
  for (const Row& row : rows) {
    const std::string more = rest(row), name = row.method() + (more.empty() ? "" : ", " + more);
    if (all.empty() || all.back().name != name)
      all.push_back({name, {}, hue_of(row.method(), known), place_in(rests, more)});
    all.back().points.push_back(point(row));
  }
  return all;
}

/// What is behind the method in the label of a variant.
std::string rest_of_label(const StudyVariant& variant, const StudyPlan& plan) {
  const std::string label = label_of(variant, plan.variants);
  return label.size() > variant.method.size() ? label.substr(variant.method.size() + 2) : std::string();
}

template <class Row>
struct Named : Row {
  const std::string& method() const { return this->variant.method; }
};

/// One picture of the solves of one step.
template <class Row, class PointOf>
io::Chart solve_chart(const std::vector<Row>& rows, const StudyPlan& plan, io::Chart chart, PointOf point) {
  std::vector<Named<Row>> named;
  for (const Row& row : rows) named.push_back({row});
  const bool both = std::ranges::any_of(rows, &Row::warm);
  chart.series = series_of(
      named,
      [&](const Named<Row>& row) {
        std::string rest = rest_of_label(row.variant, plan);
        if (both) rest += (rest.empty() ? "" : ", ") + std::string(start_of(row.warm));
        return rest;
      },
      point);
  return chart;
}

/// Seconds and sweeps that each curve took to each tolerance.
io::HtmlTable times_to_tolerance(const std::vector<io::ChartSeries>& in_seconds,
                                 const std::vector<io::ChartSeries>& in_sweeps, const StudyPlan& plan) {
  io::HtmlTable table;
  table.columns.push_back("seconds (sweeps) to a residual of");
  for (const double tolerance : plan.tolerances) table.columns.push_back(fmt::format("{:g}", tolerance));
  for (std::size_t k = 0; k < in_seconds.size(); ++k) {
    std::vector<std::string>& row = table.rows.emplace_back();
    row.push_back(in_seconds[k].name);
    for (const double tolerance : plan.tolerances) {
      const auto& points = in_seconds[k].points;
      const auto reached = std::ranges::find_if(points, [&](const auto& p) { return p[1] <= tolerance; });
      row.push_back(
          reached == points.end()
              ? "not reached"
              : fmt::format("{:.3g} ({:.0f})", (*reached)[0],
                            in_sweeps[k].points[static_cast<std::size_t>(reached - points.begin())][0]));
    }
  }
  return table;
}

/// residual.csv and true_error.csv.
void add_tables(const ProblemStudy& study, ReportPage& report) {
  io::CsvTable residual(
      {"method", "subdomains", "threads", "seed", "start", "sweeps", "seconds", "error_rms"});
  for (const ResidualRow& r : study.residual)
    residual.row(r.variant.method, r.variant.subdomains, r.variant.threads,
                 static_cast<std::int64_t>(r.variant.seed), start_of(r.warm), r.sweeps, r.seconds,
                 r.error_rms);
  io::CsvTable truth({"method", "subdomains", "threads", "seed", "start", "sweeps", "seconds", "error_rms",
                      "velocity_error", "wall_force_error", "converged"});
  for (const TrueErrorRow& r : study.truth)
    truth.row(r.variant.method, r.variant.subdomains, r.variant.threads,
              static_cast<std::int64_t>(r.variant.seed), start_of(r.warm), r.sweeps, r.seconds, r.error_rms,
              r.velocity_error, r.wall_force_error, r.converged);
  report.tables.emplace_back("residual.csv", residual.text());
  report.tables.emplace_back("true_error.csv", truth.text());
}

const char* const residual_label = "residual: relative error of the contact law  [1]";
const char* const velocity_label = "velocity error, kinetic norm, relative  [1]";
const char* const seconds_label = "elapsed time of the iterations  [s]";
const char* const sweeps_label = "sweeps  [1]";

/// The error of the contact law, which every method can be asked for.
void add_residual_charts(const std::vector<ResidualRow>& rows, const StudyPlan& plan,
                         const std::string& subtitle, ReportPage& report) {
  io::Chart sweeps = solve_chart(
      rows, plan,
      empty_chart("residual_sweeps", "Residual against sweeps", subtitle, sweeps_label, residual_label),
      [](const ResidualRow& r) {
        return std::array<double, 2>{static_cast<double>(r.sweeps), r.error_rms};
      });
  io::Chart seconds = solve_chart(
      rows, plan,
      empty_chart("residual_seconds", "Residual against run time", subtitle, seconds_label, residual_label),
      [](const ResidualRow& r) {
        return std::array<double, 2>{r.seconds, r.error_rms};
      });
  for (io::Chart* of : {&sweeps, &seconds})
    for (const double tolerance : plan.tolerances)
      of->levels.push_back({tolerance, fmt::format("tol. {:g}", tolerance)});
  const io::HtmlTable table = times_to_tolerance(seconds.series, sweeps.series, plan);
  add_chart(
      report, std::move(seconds),
      "How far each method has brought the error of the contact law after a given time, on the same step: "
      "the lower and the further left, the better.",
      table);
  add_chart(report, std::move(sweeps),
            "The same against the number of sweeps over all contacts: what is left of a difference when the "
            "cost of a sweep is taken out.");
}

/// What solves of one step are compared in: where a row stands in a picture, and what is said above it.
struct TruthPicture {
  const char *name, *title, *x_label, *y_label;
  double (*x)(const TrueErrorRow&);
  double (*y)(const TrueErrorRow&);
  std::string sentence;
};

std::vector<TruthPicture> truth_pictures(const ProblemReference& reference, bool wall_forces) {
  const auto seconds = [](const TrueErrorRow& r) { return r.seconds; };
  const auto sweeps = [](const TrueErrorRow& r) { return static_cast<double>(r.sweeps); };
  const auto velocity = [](const TrueErrorRow& r) { return r.velocity_error; };
  const std::string honesty = fmt::format(
      " The reference was solved with {} to a residual of {:.1e} and a balance of {:.1e}{}; with friction "
      "forces, and to a lesser degree velocities, are not unique, so that curves may level off above it.",
      reference.method, reference.error_rms, reference.balance,
      reference.converged ? ""
                          : fmt::format(" ({:.1e} and {:.1e} were wanted)", reference.tolerance,
                                        reference.balance_tolerance));
  std::vector<TruthPicture> pictures = {
      {"velocity_seconds", "Velocity error against run time", seconds_label, velocity_label, seconds,
       velocity,
       "How far the velocities that a solve hands back after a given time are from the reference, over "
       "the largest of the velocities themselves, what the contacts changed in them, and what a wall's "
       "impulse would give to all grains." +
           honesty},
      {"velocity_sweeps", "Velocity error against sweeps", sweeps_label, velocity_label, sweeps, velocity,
       "The same against sweeps."}};
  if (wall_forces)
    pictures.push_back(
        {"wall_forces_seconds", "Error of the wall forces against run time", seconds_label,
         "largest error of a wall's force, relative  [1]", seconds,
         [](const TrueErrorRow& r) { return r.wall_force_error; },
         "What an experiment would measure: by how much the force on the worst wall differs from the "
         "reference, over the largest of them."});
  pictures.push_back(
      {"velocity_residual", "Does the residual tell the truth?", residual_label, velocity_label,
       [](const TrueErrorRow& r) { return r.error_rms; }, velocity,
       "Velocity error against residual, both of the same solve: where a curve lies far above the other "
       "ones, a small residual promises too much."});
  return pictures;
}

}  // namespace

void report_problem(const ProblemStudy& study, const StudyPlan& plan, ReportPage& report) {
  add_tables(study, report);
  const ProblemReference& reference = study.references.front();
  const std::string subtitle =
      fmt::format("step {}: {} grains, {} contacts", reference.step, reference.bodies, reference.contacts);
  add_residual_charts(study.residual, plan, subtitle, report);
  const bool wall_forces =
      std::ranges::any_of(study.truth, [](const auto& r) { return !std::isnan(r.wall_force_error); });
  for (const TruthPicture& picture : truth_pictures(reference, wall_forces))
    add_chart(
        report,
        solve_chart(study.truth, plan,
                    empty_chart(picture.name, picture.title, subtitle, picture.x_label, picture.y_label),
                    [&](const TrueErrorRow& r) {
                      return std::array<double, 2>{picture.x(r), picture.y(r)};
                    }),
        picture.sentence);
}

void report_runs(const RunStudy& study, const StudyPlan& plan, ReportPage& report) {
  io::CsvTable runs({"method", "subdomains", "threads", "seed", "time_step", "tolerance", "steps", "sweeps",
                     "missed_steps", "seconds", "stress_error", "position_error"});
  for (const RunRow& r : study.rows)
    runs.row(r.variant.method, r.variant.subdomains, r.variant.threads,
             static_cast<std::int64_t>(r.variant.seed), r.time_step, r.tolerance, r.steps, r.sweeps, r.missed,
             r.seconds, r.stress_error, r.position_error);
  report.tables.emplace_back("runs.csv", runs.text());
  const RunReference& reference = study.references.front();
  const std::string subtitle = fmt::format("{:.4g} s simulated; points: tolerances {:g} to {:g}",
                                           reference.time, plan.tolerances.front(), plan.tolerances.back());
  const auto chart = [&](const char* name, const char* title, const char* y_label, double RunRow::*value) {
    std::vector<Named<RunRow>> named;
    for (const RunRow& row : study.rows) named.push_back({row});
    io::Chart out = empty_chart(name, title, subtitle, "elapsed time of all steps  [s]", y_label);
    out.series = series_of(
        named,
        [&](const Named<RunRow>& row) {
          std::string rest = rest_of_label(row.variant, plan);
          if (plan.time_steps.size() > 1)
            rest += (rest.empty() ? "" : ", ") + fmt::format("Δt × {:g}", row.time_step);
          return rest;
        },
        [&](const Named<RunRow>& row) {
          return std::array<double, 2>{row.seconds, row.*value};
        });
    return out;
  };
  const std::string of_reference = fmt::format(
      " The reference has a tolerance of {:.1e} and {:g} times the time step of the scene{}.",
      reference.tolerance, reference.time_step,
      reference.missed > 0
          ? fmt::format("; {} of its {} steps missed that tolerance", reference.missed, reference.steps)
          : "");
  io::HtmlTable table{
      {"run", "tolerance", "steps", "sweeps", "missed", "seconds", "q/p error", "position error"}, {}};
  for (const RunRow& r : study.rows)
    table.rows.push_back({label_of(r.variant, plan.variants) + fmt::format(", Δt × {:g}", r.time_step),
                          fmt::format("{:g}", r.tolerance), fmt::format("{}", r.steps),
                          fmt::format("{}", r.sweeps), fmt::format("{}", r.missed),
                          fmt::format("{:.3g}", r.seconds), fmt::format("{:.2e}", r.stress_error),
                          fmt::format("{:.2e}", r.position_error)});
  if (std::ranges::any_of(study.rows, [](const RunRow& r) { return !std::isnan(r.stress_error); })) {
    io::Chart stress = chart("run_stress_seconds", "Error of q/p over a run against run time",
                             "rms difference in q/p  [1]", &RunRow::stress_error);
    if (const double scatter = scatter_of_seeds(study); scatter > 0)
      stress.levels.push_back({scatter, "seed to seed"});
    add_chart(report, std::move(stress),
              "What a tighter tolerance or a smaller time step buys in the stress ratio of a whole run, and "
              "what it costs." +
                  of_reference);
  }
  add_chart(
      report,
      chart("run_position_seconds", "Error of the grains' positions after a run against run time",
            "rms distance over mean diameter  [1]", &RunRow::position_error),
      "How far the grains end up from where they are in the reference; trajectories of dense flows part "
      "exponentially, so that over long runs no method keeps this small." +
          of_reference,
      table);
}

void report_profile(const std::vector<ProfileRow>& rows, ReportPage& report) {
  io::CsvTable solves({"problem", "contacts", "method", "tolerance", "seconds", "iterations", "error",
                       "scaled_error", "solved"});
  for (const auto& [tolerance, r] : rows)
    solves.row(r.problem, static_cast<std::int64_t>(r.contacts), r.method, tolerance, r.seconds, r.iterations,
               r.error, r.scaled_error, r.converged);
  io::CsvTable profile({"method", "tolerance", "ratio", "solved_part"});
  std::vector<std::string> methods;
  std::vector<double> tolerances;
  std::vector<std::vector<SolveRow>> solves_to;  // per tolerance
  for (const auto& [tolerance, solve] : rows) {
    place_in(methods, solve.method);
    const std::size_t place = place_in(tolerances, tolerance);
    solves_to.resize(tolerances.size());
    solves_to[place].push_back(solve);
  }
  // A picture for each tolerance: with all curves in one, none can be followed.
  std::vector<io::Chart> charts;
  for (const double tolerance : tolerances)
    charts.push_back(
        {.name = charts.empty() ? "profile" : fmt::format("profile_{}", charts.size() + 1),
         .title = fmt::format("Performance profile, tolerance {:g}", tolerance),
         .subtitle = "part of the problems solved within a multiple of the fastest method's time",
         .x_label = "time over that of the fastest method  [1]",
         .y_label = "problems solved  [1]",
         .log_y = false,
         .staircase = true,
         .series = {},
         .levels = {{1, "all"}, {0, "none"}}});
  const std::vector<std::string> known = profile_methods();
  io::HtmlTable table{{"method", "tolerance", "solved", "problems", "geometric mean of the times [s]"}, {}};
  double slowest = 1;
  for (const std::string& method : methods)
    for (const std::vector<SolveRow>& solved : solves_to)
      for (const auto& point : profile_of(solved, method)) slowest = std::max(slowest, point[0]);
  for (const std::string& method : methods)
    for (std::size_t t = 0; t < tolerances.size(); ++t) {
      auto points = profile_of(solves_to[t], method);
      // All curves are drawn as far as the longest.
      if (!points.empty() && points.back()[0] < slowest) points.push_back({slowest, points.back()[1]});
      for (const auto& [ratio, part] : points) profile.row(method, tolerances[t], ratio, part);
      charts[t].series.push_back({method, points, hue_of(method, known)});
      double logarithms = 0;
      int solved = 0, problems = 0;
      for (const SolveRow& r : solves_to[t]) {
        if (r.method != method) continue;
        ++problems;
        if (!r.converged) continue;
        ++solved;
        logarithms += std::log(r.seconds);
      }
      table.rows.push_back({method, fmt::format("{:g}", tolerances[t]), fmt::format("{}", solved),
                            fmt::format("{}", problems),
                            solved > 0 ? fmt::format("{:.3g}", std::exp(logarithms / solved)) : "none"});
    }
  report.tables.emplace_back("solves.csv", solves.text());
  report.tables.emplace_back("profile.csv", profile.text());
  for (std::size_t t = 0; t < charts.size(); ++t)
    add_chart(report, std::move(charts[t]),
              t > 0
                  ? "The same to another tolerance."
                  : "For every method the part of the problems that it solves in at most so many times the "
                    "time of the fastest one: where a curve begins says how often the method is the fastest, "
                    "where it ends how many problems it solves at all.",
              t + 1 == charts.size() ? std::move(table) : io::HtmlTable{});
}

bool is_study_error_name(const std::string& name) {
  constexpr std::array<std::string_view, 5> tables{"residual.csv", "true_error.csv", "runs.csv", "solves.csv",
                                                   "profile.csv"};
  constexpr std::array<std::string_view, 9> charts{
      "residual_seconds",   "residual_sweeps",      "velocity_seconds",
      "velocity_sweeps",    "wall_forces_seconds",  "velocity_residual",
      "run_stress_seconds", "run_position_seconds", "profile"};
  return is_report_name(name, tables, charts) || io::is_numbered_name(name, "profile_", ".svg");
}

}  // namespace talus
