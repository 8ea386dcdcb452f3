#pragma once

/// Curves over two axes, as SVG text and as a gnuplot script that draws the same from the table beside it.

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace talus::io {

struct ChartSeries {
  std::string name;  ///< in the legend
  std::vector<std::array<double, 2>> points;
  std::size_t hue = 0;   ///< colour, counted from 0 and repeated when there are more than the palette has
  std::size_t dash = 0;  ///< 0: full line; others: patterns, repeated likewise
  /// Cells that a row of the table must have to be of this series: column and text.
  std::vector<std::pair<std::string, std::string>> where = {};
  std::string table = {};  ///< file name of a table of its own with the chart's columns; "": the chart's
};

/// A horizontal line that says what a value means.
struct ChartLevel {
  double y;
  std::string name;
};

struct Chart {
  std::string name;  ///< of its files, without extension
  std::string title, subtitle;
  std::string x_label, y_label;  ///< with units
  bool log_x = true, log_y = true;
  bool staircase = false;  ///< a value holds up to the next point
  std::string table;       ///< file name of the CSV table
  std::string x_column, y_column;
  std::vector<ChartSeries> series;
  std::vector<ChartLevel> levels = {};
};

/// Points that are not finite, or not positive on a logarithmic axis, are left out; without any point the
/// picture says so.
std::string draw_chart(const Chart& chart);

/// A script for gnuplot 5, to be run in the folder of the tables: NAME.gnuplot.svg for every chart.
std::string gnuplot_script(std::span<const Chart> charts);

}  // namespace talus::io
