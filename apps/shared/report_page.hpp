#pragma once

/// The page that a study leaves: tables, pictures, and text that explains each picture.

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "io/pictures/chart.hpp"
#include "io/pictures/html_page.hpp"

namespace talus {

/// A part of the page and the files behind it.
struct ReportPage {
  std::string title, introduction;
  std::vector<std::pair<std::string, std::string>> tables;  ///< file name, CSV text
  std::vector<io::Chart> charts;
  std::vector<io::HtmlSection> sections;
};

/// "Talus 0.1 (commit) on a host, 2 cores for this process, date.": where and when a study was made.
std::string where_and_when();

/// A chart without curves.
io::Chart empty_chart(const std::string& name, const std::string& title, const std::string& subtitle,
                      const std::string& x_label, const std::string& y_label);

/// A picture, on the page under its title with a sentence above and a table below.
void add_chart(ReportPage& report, io::Chart chart, const std::string& sentence, io::HtmlTable table = {});

/// Writes the tables, NAME.svg for every chart and report.html. Throws io::FileError.
void write_report(const std::filesystem::path& directory, const ReportPage& report);

/// True for the names of what write_report makes of `tables` (names of files) and `charts` (their names).
bool is_report_name(std::string_view name, std::span<const std::string_view> tables,
                    std::span<const std::string_view> charts);

}  // namespace talus
