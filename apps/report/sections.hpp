#pragma once

/// The sections of a run's page. Each is empty where the run has nothing for it.

#include <array>
#include <map>
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
/// How many of the steps missed a tolerance.
std::string certificate_sentence(std::size_t steps, std::size_t missed);
HtmlSections experiment_sections(const RunFolder& run);
/// Of cell.csv: stresses, solid fraction, coordination and inertial number of a periodic cell.
HtmlSections cell_section(const RunFolder& run);
/// Of probes.csv: a curve for each probe.
HtmlSections probe_section(const RunFolder& run);
/// The sample in space.
HtmlSections view_section(const RunFolder& run);
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

inline constexpr const char* time_label = "time [s]";
inline constexpr std::size_t most_curves = 8;  ///< of a chart: hues that are told apart

/// Adds a curve, unless there are `most_curves` already.
void add_curve(io::Chart& chart, const std::string& name, std::span<const double> x,
               std::span<const double> y);
/// Adds the chart unless it is empty.
void add_figure(io::HtmlSection& section, const io::Chart& chart, std::string caption = {});
std::vector<double> scaled(std::span<const double> values, double factor);
/// Whether one of them is not 0.
bool any_value(std::span<const double> values);

/// Values of a table by the name that its rows carry, in the order in which names appear.
struct ByName {
  std::vector<std::string> names;
  std::map<std::string, std::map<std::string, std::vector<double>>> values;  ///< by name, then column
};
ByName by_name(const io::TableColumns& table);

}  // namespace talus
