#pragma once

/// The sections of a run's page. Each is empty where the run has nothing for it.

#include <array>
#include <span>
#include <string>
#include <vector>

#include "apps/report/run_folder.hpp"
#include "io/pictures/chart.hpp"
#include "io/pictures/html_page.hpp"

namespace talus {

using HtmlSections = std::vector<io::HtmlSection>;

HtmlSections scene_section(const RunFolder& run);
HtmlSections certificate_section(const RunFolder& run);
HtmlSections experiment_sections(const RunFolder& run);
HtmlSections picture_section(const RunFolder& run);
HtmlSections time_section(const RunFolder& run);
HtmlSections left_out_section(const RunFolder& run);
HtmlSections repeat_section(const RunFolder& run);

/// How many points stand for many rows in a chart.
enum class Thinned {
  largest,  ///< the largest of each stretch of rows: no peak of an error is lost
  evenly,   ///< one row of each
};
/// Points (x, y), at most a few hundred.
std::vector<std::array<double, 2>> thinned(std::span<const double> x, std::span<const double> y, Thinned how);

/// A compact chart over linear x without curves.
io::Chart small_chart(const std::string& title, const std::string& x_label, const std::string& y_label,
                      bool log_y = false);

}  // namespace talus
