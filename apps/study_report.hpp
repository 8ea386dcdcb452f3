#pragma once

/// What a study leaves: tables, pictures, a gnuplot script that draws the tables, and a page that explains
/// each picture.

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "apps/study_problem.hpp"
#include "apps/study_profile.hpp"
#include "apps/study_runs.hpp"
#include "io/chart.hpp"
#include "io/html_page.hpp"

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

/// True for the names that a study may have written: those of write_report, and the scenes, traces and
/// scripts of `talus study scaling`.
bool is_study_name(const std::filesystem::path& relative);

}  // namespace talus
