#include "apps/study_scaling/scaling_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <regex>
#include <string_view>

#include "apps/shared/child_process.hpp"
#include "io/files/csv_table.hpp"
#include "io/files/output_directory.hpp"

namespace talus {

namespace {

/// The overrides of a variant without the tables of their keys, which would not fit beside a picture.
std::string short_name(const std::string& variant) {
  std::string text;
  for (const std::string& word : split_words(variant)) {
    const std::size_t equals = std::min(word.find('='), word.size()), dot = word.rfind('.', equals);
    text += " " + (dot == std::string::npos ? word : word.substr(dot + 1));
  }
  return text;
}

/// What curve of the pictures a row belongs to; predicted ones say so.
std::string curve_of(const ScalingRow& row) {
  std::string name =
      !row.predicted()
          ? std::string("measured")
          : fmt::format("predicted{} [{}]", row.source == ScalingSource::smpi ? " by SMPI" : "", row.network);
  if (row.kind == ScalingKind::hybrid) name = fmt::format("{} cores: {}", row.cores(), name);
  if (row.kind != ScalingKind::hybrid && row.threads > 1)
    name += row.ranks == 1 ? " threads" : " ranks x threads";
  return name + short_name(row.variant);
}

std::string table_of(const std::vector<ScalingRow>& rows, ScalingKind kind) {
  io::CsvTable table(
      {"curve",        "result",     "source",        "network",  "variant",    "subdomains",    "ranks",
       "threads",      "cores",      "grains",        "contacts", "repeats",    "seconds",       "fastest",
       "slowest",      "iterations", "missed",        "speedup",  "efficiency", "of_iterations", "of_sweeps",
       "work",         "balance",    "communication", "within",   "bound",      "critical_path", "exposed",
       "partitioning", "detection",  "inloop_1",      "inloop_2", "update"});
  for (const ScalingRow& r : rows)
    if (r.kind == kind) {
      const auto part = [&](std::size_t p) { return r.source == ScalingSource::replay ? r.share[p] : r.nan; };
      table.row(curve_of(r), r.predicted() ? "predicted" : "measured", name_of(r.source), r.network,
                r.variant, r.subdomains, r.ranks, r.threads, r.cores(), static_cast<std::int64_t>(r.grains),
                r.contacts, r.repeats, r.seconds, r.fastest, r.slowest, r.iterations, r.missed, r.speedup,
                r.efficiency, r.of_iterations, r.of_sweeps, r.work, r.balance, r.communication, r.within,
                bound_of(r), r.path, r.exposed, part(0), part(1), part(2), part(3), part(4));
    }
  return table.text();
}

/// Among the curves of all pictures: the same colour in each.
std::size_t place_of_curve(const std::vector<ScalingRow>& rows, const std::string& name) {
  std::vector<std::string> names;
  for (const ScalingRow& row : rows)
    if (std::ranges::find(names, curve_of(row)) == names.end()) names.push_back(curve_of(row));
  return static_cast<std::size_t>(std::ranges::find(names, name) - names.begin());
}

/// The rows of a kind as curves over `x`.
template <class X, class Y>
void add_curves(const std::vector<ScalingRow>& rows, ScalingKind kind, X x, Y y, io::Chart& chart) {
  for (const ScalingRow& row : rows) {
    if (row.kind != kind) continue;
    const std::string name = curve_of(row);
    auto found = std::ranges::find(chart.series, name, &io::ChartSeries::name);
    if (found == chart.series.end()) {
      const std::size_t number = place_of_curve(rows, name);
      chart.series.push_back({name, {}, number, row.predicted() ? 1U : 0U});
      found = chart.series.end() - 1;
    }
    found->points.push_back({x(row), y(row)});
  }
}

io::Chart chart_of(const char* name, const std::string& title, const std::string& x, const std::string& y) {
  return empty_chart(name, title, "dashed: predicted, nothing of it was measured", x, y);
}

double cores(const ScalingRow& row) {
  return row.cores();
}

std::string cell(double value, const char* form = "{:.3g}") {
  return std::isfinite(value) ? fmt::format(fmt::runtime(form), value) : "";
}

std::string percent(double part) {
  return std::isfinite(part) ? fmt::format("{:.1f} %", 100 * part) : "";
}

io::HtmlTable efficiency_table(const std::vector<ScalingRow>& rows, ScalingKind kind) {
  io::HtmlTable table{{"curve", "ranks x threads", "subdomains", "grains", "s a step (range)", "iterations",
                       "missed", "speedup", "efficiency", "= iterations", "x time an iteration", "bound"},
                      {}};
  for (const ScalingRow& r : rows)
    if (r.kind == kind)
      table.rows.push_back({curve_of(r), fmt::format("{} x {}", r.ranks, r.threads),
                            fmt::format("{}", r.subdomains), fmt::format("{}", r.grains),
                            r.repeats > 1 ? fmt::format("{:.3g} ({:.3g} - {:.3g}, {})", r.seconds, r.fastest,
                                                        r.slowest, r.repeats)
                                          : fmt::format("{:.3g}", r.seconds),
                            cell(r.iterations, "{:.1f}"), fmt::format("{}", r.missed), cell(r.speedup),
                            cell(r.efficiency), cell(r.of_iterations), cell(r.of_sweeps), bound_of(r)});
  return table;
}

io::HtmlTable share_table(const std::vector<ScalingRow>& rows) {
  io::HtmlTable table{
      {"predicted", "ranks x threads", "partitioning", "contact detection", "inloop 1", "inloop 2", "update",
       "exposed messages", "work a sweep", "load balance", "communication", "within ranks", "critical path"},
      {}};
  for (const ScalingRow& r : rows)
    if (r.source == ScalingSource::replay && r.kind == ScalingKind::strong)
      table.rows.push_back({curve_of(r), fmt::format("{} x {}", r.ranks, r.threads), percent(r.share[0]),
                            percent(r.share[1]), percent(r.share[2]), percent(r.share[3]),
                            percent(r.share[4]), percent(r.exposed), cell(r.work), cell(r.balance),
                            cell(r.communication), cell(r.within), r.path});
  return table;
}

bool any_of_kind(const std::vector<ScalingRow>& rows, ScalingKind kind) {
  return std::ranges::any_of(rows, [&](const ScalingRow& r) { return r.kind == kind; });
}

std::string introduction_of(const ScalingReport& report) {
  std::string text = report.description.empty() ? "" : report.description + ". ";
  text +=
      fmt::format("{} Means over steps {} to {}. ", where_and_when(), report.plan.first, report.plan.last);
  text +=
      "Measured: medians of runs that took turns, their range in brackets. Predicted: a run on one rank and "
      "thread with as many subdomains was recorded, and its tasks were played on the machine; nothing of it "
      "was measured there. Networks:";
  for (const ScalingNetwork& network : report.plan.networks)
    text += fmt::format(" {}: {}.", network.name, network.description);
  if (report.plan.typical) text += " Tasks that took over three times their median were given the median.";
  text +=
      report.plan.own_caches
          ? " Before a subdomain's tasks were timed its data were read into the cache, as they are in that "
            "of a core that has no other subdomain; 1 x 1 is as it ran."
          : " Caches are those of the recording, where one core has all subdomains.";
  if (report.plan.quantile > 0)
    text +=
        fmt::format(" Tasks were given the {:g} quantile of their times in the step: the machine was busy.",
                    report.plan.quantile);
  const auto missed = std::ranges::count_if(report.rows, [](const ScalingRow& r) { return r.missed > 0; });
  if (missed > 0)
    text += fmt::format(
        " Of {} of the {} rows the runs, or those that were recorded, missed the tolerance in some of these "
        "steps (column `missed`): their times are those of solves that were given up, and speedups of such "
        "rows compare sweeps, not solutions.",
        missed, report.rows.size());
  return text;
}

void add_other_curves(const std::vector<OtherSpeedup>& beside, bool efficiency, io::Chart& chart) {
  for (const OtherSpeedup& other : beside) {
    auto found = std::ranges::find(chart.series, other.name, &io::ChartSeries::name);
    if (found == chart.series.end()) {
      chart.series.push_back({other.name, {}, chart.series.size(), 2});
      found = chart.series.end() - 1;
    }
    found->points.push_back({other.cores, efficiency ? other.speedup / other.cores : other.speedup});
  }
}

void add_strong(const ScalingReport& report, ReportPage& page) {
  const std::vector<ScalingRow>& rows = report.rows;
  io::Chart speedup = chart_of("speedup", "Strong scaling: speedup", "cores", "speedup  [1]");
  add_curves(
      rows, ScalingKind::strong, cores, [](const ScalingRow& r) { return r.speedup; }, speedup);
  add_other_curves(report.plan.beside, false, speedup);
  add_chart(page, std::move(speedup), "Time of a step on one core over that on more, for the same sample.",
            efficiency_table(rows, ScalingKind::strong));
  io::Chart efficiency =
      chart_of("efficiency", "Strong scaling: efficiency", "cores", "speedup over cores  [1]");
  efficiency.log_y = false;
  io::Chart iterations = efficiency, sweeps = efficiency;
  add_curves(
      rows, ScalingKind::strong, cores, [](const ScalingRow& r) { return r.efficiency; }, efficiency);
  add_other_curves(report.plan.beside, true, efficiency);
  add_chart(page, std::move(efficiency),
            "The same per core. It is the product of the two factors in the pictures below.");
  iterations.levels = sweeps.levels = {{1, "ideal"}};
  iterations.name = "efficiency_iterations";
  iterations.title = "Strong scaling: iterations on one core over those on more";
  add_curves(
      rows, ScalingKind::strong, cores, [](const ScalingRow& r) { return r.of_iterations; }, iterations);
  add_chart(
      page, std::move(iterations),
      "What more subdomains cost in convergence: a matter of the method and the sample, not of the machine.");
  sweeps.name = "efficiency_sweeps";
  sweeps.title = "Strong scaling: efficiency of an iteration";
  add_curves(
      rows, ScalingKind::strong, cores, [](const ScalingRow& r) { return r.of_sweeps; }, sweeps);
  add_chart(
      page, std::move(sweeps),
      "What is left when iterations are taken out: work of copies, load imbalance, messages and waiting. The "
      "table has these factors of each prediction; their product is the curve.",
      share_table(rows));
}

/// As many times faster as there are cores, up to the largest machine.
std::vector<OtherSpeedup> ideal(const std::vector<ScalingRow>& rows) {
  double most = 1;
  for (const ScalingRow& r : rows)
    if (r.kind == ScalingKind::strong) most = std::max(most, cores(r));
  return {{"ideal", 1, 1}, {"ideal", most, most}};
}

ReportPage page_of(ScalingReport report) {
  ReportPage page;
  const std::vector<OtherSpeedup> best = ideal(report.rows);
  report.plan.beside.insert(report.plan.beside.end(), best.begin(), best.end());
  page.title = fmt::format("{}: scaling", report.name);
  page.introduction = introduction_of(report);
  const std::vector<ScalingRow>& rows = report.rows;
  page.tables.emplace_back("strong_scaling.csv", table_of(rows, ScalingKind::strong));
  io::CsvTable others({"name", "cores", "speedup", "efficiency"});
  for (const OtherSpeedup& other : report.plan.beside)
    others.row(other.name, other.cores, other.speedup, other.speedup / other.cores);
  page.tables.emplace_back("beside.csv", others.text());
  add_strong(report, page);
  if (any_of_kind(rows, ScalingKind::weak)) {
    page.tables.emplace_back("weak_scaling.csv", table_of(rows, ScalingKind::weak));
    io::Chart weak = chart_of("weak_efficiency", "Weak scaling: efficiency", "cores",
                              "speed per core over that of one core  [1]");
    weak.log_y = false;
    weak.levels.push_back({1, "ideal"});
    add_curves(
        rows, ScalingKind::weak, cores, [](const ScalingRow& r) { return r.efficiency; }, weak);
    add_chart(
        page, std::move(weak),
        "Samples with as many grains per core. Larger samples need more iterations, whoever solves them.",
        efficiency_table(rows, ScalingKind::weak));
  }
  if (any_of_kind(rows, ScalingKind::hybrid)) {
    page.tables.emplace_back("hybrid.csv", table_of(rows, ScalingKind::hybrid));
    io::Chart hybrid =
        chart_of("hybrid", "Ranks x threads on the same cores", "threads of a rank", "time of a step  [s]");
    add_curves(
        rows, ScalingKind::hybrid, [](const ScalingRow& r) { return static_cast<double>(r.threads); },
        [](const ScalingRow& r) { return r.seconds; }, hybrid);
    add_chart(
        page, std::move(hybrid),
        "The same cores and subdomains, divided into ranks and threads. Ranks on one node share its link.",
        efficiency_table(rows, ScalingKind::hybrid));
  }
  return page;
}

/// "weak-12.csv", "traces/strong-4-variant1-own-2.h5".
bool is_numbered(const std::string& name) {
  static const std::regex numbered(
      R"(weak-\d+\.(toml|csv)|traces/(strong|weak)-\d+(-variant\d+)?(-own)?-\d+\.h5)");
  return std::regex_match(name, numbered);
}

}  // namespace

bool is_study_scaling_name(const std::string& name) {
  constexpr std::array<std::string_view, 4> tables{"strong_scaling.csv", "weak_scaling.csv", "hybrid.csv",
                                                   "beside.csv"};
  constexpr std::array<std::string_view, 6> charts{
      "speedup", "efficiency", "efficiency_iterations", "efficiency_sweeps", "weak_efficiency", "hybrid"};
  constexpr std::array<std::string_view, 5> others{"commands.sh", "slurm.sh", "strong.toml", "strong.csv",
                                                   "traces/times.csv"};
  return is_report_name(name, tables, charts) || std::ranges::find(others, name) != others.end() ||
         is_numbered(name);
}

void write_scaling_report(const std::filesystem::path& directory, const ScalingReport& report) {
  io::write_whole(directory / "commands.sh", report.commands.lines);
  io::write_whole(directory / "slurm.sh", report.commands.slurm);
  if (!report.rows.empty()) write_report(directory, page_of(report));
}

}  // namespace talus
