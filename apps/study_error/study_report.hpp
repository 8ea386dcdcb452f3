#pragma once

/// What a study leaves: tables, pictures, a gnuplot script that draws the tables, and a page that explains
/// each picture.

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "apps/study_error/study_problem.hpp"
#include "apps/study_error/study_profile.hpp"
#include "apps/study_error/study_runs.hpp"
#include "io/pictures/chart.hpp"
#include "io/pictures/html_page.hpp"

namespace talus {

/// A part of the page and the files behind it.
struct StudyReport {
  std::string title, introduction;
  std::vector<std::pair<std::string, std::string>> tables;  ///< file name, CSV text
  std::vector<io::Chart> charts;
  std::vector<io::HtmlSection> sections;
};

void report_problem(const ProblemStudy& study, const StudyPlan& plan, StudyReport& report);
void report_runs(const RunStudy& study, const StudyPlan& plan, StudyReport& report);
void report_profile(const std::vector<ProfileRow>& rows, StudyReport& report);

/// A picture, on the page under its title with a sentence above and a table below.
void add_chart(StudyReport& report, io::Chart chart, const std::string& sentence, io::HtmlTable table = {});

/// Writes the tables, NAME.svg for every chart, plot.gp and report.html. Throws io::FileError.
void write_report(const std::filesystem::path& directory, const StudyReport& report);

/// True for the names of what write_report makes of `tables` (names of files) and `charts` (their names), and
/// of what its plot.gp draws.
bool is_report_name(std::string_view name, std::span<const std::string_view> tables,
                    std::span<const std::string_view> charts);

/// True for the names of files that `talus study error` may have written.
bool is_study_error_name(const std::string& name);

}  // namespace talus
