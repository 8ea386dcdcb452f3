#include "apps/study_certificate/certificate_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <set>
#include <string_view>

#include "apps/shared/report_page.hpp"
#include "apps/study_certificate/scene_maker.hpp"
#include "io/files/csv_table.hpp"

namespace talus::audit {

namespace {

constexpr std::array<std::string_view, 2> tables{"calibration.csv", "steps.csv"};

std::string chart_of(const Measure& measure) {
  return fmt::format("certificate-{}", measure.name);
}

std::string_view word_of(Judged judged) {
  switch (judged) {
    case Judged::yes:
      return "yes";
    case Judged::no_reference:
      return "no reference";
    case Judged::no_answer:
      return "no answer";
    case Judged::other_problem:
      return "other problem";
  }
  return "";
}

std::string calibration_csv(std::span<const CalibrationRow> rows) {
  io::CsvTable table({"tolerance",    "family",     "measure",    "steps",       "certified",
                      "judged",       "unjudged",   "unsolvable", "overlapping", "disputed",
                      "missed_share", "claimed_50", "claimed_95", "claimed_999", "claimed_worst",
                      "asked_50",     "asked_95",   "asked_999",  "asked_worst", "worst"});
  for (const CalibrationRow& row : rows)
    table.row(row.tolerance, row.family, row.measure, row.steps, row.certified, row.judged, row.unjudged,
              row.unsolvable, row.overlapping, row.disputed, row.missed_share(), row.claimed.median,
              row.claimed.most, row.claimed.nearly_all, row.claimed.worst, row.asked.median, row.asked.most,
              row.asked.nearly_all, row.asked.worst, row.worst);
  return table.text();
}

std::string steps_csv(std::span<const StepOfScene> steps) {
  io::CsvTable table({"scene",       "family",     "tolerance",   "step",          "contacts",
                      "clusters",    "smooth",     "certified",   "overlapping",   "error_rms",
                      "balance",     "claimed",    "asked",       "judged",        "V",
                      "wf",          "cf",         "cluster",     "energy",        "residual",
                      "uncertainty", "iterations", "run_seconds", "audit_seconds", "why"});
  for (const StepOfScene& one : steps) {
    const AuditedStep& s = one.step;
    table.row(one.scene, one.family, one.tolerance, s.step, s.contacts, s.clusters, s.smooth, s.certified,
              s.overlapping, s.error_rms, s.balance, s.claimed, s.asked, word_of(s.judged), s.errors.velocity,
              s.errors.wall_force, s.errors.contact_force, s.errors.cluster, s.errors.energy, s.residual,
              s.uncertainty, s.iterations, s.run_seconds, s.audit_seconds, s.why);
  }
  return table.text();
}

/// Share of the certified and judged steps whose error is beyond so many times their claim.
io::ChartSeries curve_of(std::span<const StepOfScene> steps, double tolerance, const Measure& measure) {
  std::vector<double> ratios;
  for (const StepOfScene& one : steps)
    if (one.tolerance == tolerance && one.step.certified && one.step.judged == Judged::yes)
      ratios.push_back(one.step.errors.*measure.error / one.step.claimed);
  std::ranges::sort(ratios);
  io::ChartSeries series;
  series.name = fmt::format("tolerance {:.0e}", tolerance);
  const auto count = static_cast<double>(ratios.size());
  for (std::size_t k = 0; k < ratios.size(); ++k)
    if (k % (1 + ratios.size() / 2000) == 0 || k + 50 > ratios.size())
      series.points.push_back({std::max(ratios[k], 1e-6), (count - static_cast<double>(k)) / count});
  return series;
}

const std::vector<std::string> columns{
    "tolerance", "family",   "measure", "steps", "missed", "judged", "no reference",  "no answer",
    "overlaps",  "disputed", "median",  "95 %",  "99.9 %", "worst",  "worst / asked", "worst step"};

std::vector<std::string> cells_of(const CalibrationRow& row) {
  const auto number = [](double value) { return fmt::format("{:.2g}", value); };
  return {fmt::format("{:.0e}", row.tolerance),
          row.family,
          std::string(row.measure),
          fmt::format("{}", row.steps),
          fmt::format("{:.1f} %", 100 * row.missed_share()),
          fmt::format("{}", row.judged),
          fmt::format("{}", row.unjudged),
          fmt::format("{}", row.unsolvable),
          fmt::format("{}", row.overlapping),
          fmt::format("{}", row.disputed),
          number(row.claimed.median),
          number(row.claimed.most),
          number(row.claimed.nearly_all),
          number(row.claimed.worst),
          number(row.asked.worst),
          row.worst};
}

}  // namespace

std::string calibration_table(std::span<const CalibrationRow> rows, bool families) {
  std::vector<std::vector<std::string>> lines{columns};
  for (const CalibrationRow& row : rows)
    if (families || row.family == "all") lines.push_back(cells_of(row));
  std::vector<std::size_t> widths(columns.size(), 0);
  for (const auto& line : lines)
    for (std::size_t k = 0; k < line.size(); ++k) widths[k] = std::max(widths[k], line[k].size());
  std::string text;
  for (const auto& line : lines) {
    for (std::size_t k = 0; k + 1 < line.size(); ++k) text += fmt::format("{:>{}}  ", line[k], widths[k]);
    text += line.back() + "\n";
  }
  return text;
}

void write_certificate_report(const std::filesystem::path& directory, std::span<const StepOfScene> steps,
                              std::span<const CalibrationRow> rows, const std::string& summary) {
  ReportPage report;
  report.title = "What certified steps claim, and how wrong they are";
  report.introduction = summary + " " + where_and_when();
  report.tables = {{"calibration.csv", calibration_csv(rows)}, {"steps.csv", steps_csv(steps)}};
  std::set<double, std::greater<>> tolerances;
  for (const StepOfScene& one : steps) tolerances.insert(one.tolerance);
  io::HtmlTable overview{columns, {}}, by_family{columns, {}};
  for (const CalibrationRow& row : rows)
    (row.family == "all" ? overview : by_family).rows.push_back(cells_of(row));
  report.sections.push_back(
      {"All families",
       "True error over the larger of error_rms, balance and tolerance, of the steps that "
       "are certified and whose exact answer is known.",
       "", overview});
  for (const Measure& measure : measures()) {
    io::Chart chart =
        empty_chart(chart_of(measure), fmt::format("{}", measure.name), std::string(measure.meaning),
                    "true error / claimed error", "share of certified steps beyond");
    for (const double tolerance : tolerances) {
      chart.series.push_back(curve_of(steps, tolerance, measure));
      chart.series.back().hue = chart.series.size() - 1;
    }
    add_chart(report, std::move(chart), "A certificate is right where the curve has come down to zero by 2.");
  }
  report.sections.push_back({"Family by family", "The same of each family.", "", by_family});
  write_report(directory, report);
}

bool is_certificate_name(const std::string& name) {
  std::vector<std::string> charts;
  for (const Measure& measure : measures()) charts.push_back(chart_of(measure));
  const std::vector<std::string_view> views(charts.begin(), charts.end());
  if (is_report_name(name, tables, views)) return true;
  const bool kept = name.ends_with(".toml") || name.ends_with(".csv");
  return kept && std::ranges::any_of(scene_families(), [&](const SceneFamily& family) {
           return name.starts_with(std::string(family.name) + "-");
         });
}

}  // namespace talus::audit
