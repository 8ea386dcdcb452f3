#include "apps/shared/report_page.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "io/files/output_directory.hpp"
#include "io/results/run_json.hpp"
#include "io/results/version.hpp"

namespace talus {

std::string where_and_when() {
  const io::Provenance provenance = io::collect_provenance();
  return fmt::format("Talus {} ({}) on {}, {} cores for this process, {}.", io::version(),
                     provenance.git_hash, provenance.host, provenance.cores_allowed, provenance.date_utc);
}

io::Chart empty_chart(const std::string& name, const std::string& title, const std::string& subtitle,
                      const std::string& x_label, const std::string& y_label) {
  return io::Chart{.name = name,
                   .title = title,
                   .subtitle = subtitle,
                   .x_label = x_label,
                   .y_label = y_label,
                   .series = {}};
}

void add_chart(ReportPage& report, io::Chart chart, const std::string& sentence, io::HtmlTable table) {
  report.sections.push_back({chart.title, sentence, io::draw_chart(chart), std::move(table)});
  report.charts.push_back(std::move(chart));
}

void write_report(const std::filesystem::path& directory, const ReportPage& report) {
  for (const auto& [name, text] : report.tables) io::write_whole(directory / name, text);
  for (const io::Chart& chart : report.charts)
    io::write_whole(directory / (chart.name + ".svg"), io::draw_chart(chart));
  io::write_whole(directory / "report.html",
                  io::html_page(report.title, report.introduction, report.sections));
}

bool is_report_name(std::string_view name, std::span<const std::string_view> tables,
                    std::span<const std::string_view> charts) {
  const auto is_chart = [&](std::string_view chart) { return name == std::string(chart) + ".svg"; };
  return name == "report.html" || std::ranges::find(tables, name) != tables.end() ||
         std::ranges::any_of(charts, is_chart);
}

}  // namespace talus
