#pragma once

/// Curves over two axes, as SVG text.

#include <array>
#include <cstddef>
#include <string>
#include <vector>

namespace talus::io {

struct ChartSeries {
  std::string name;  ///< in the legend; of a compact chart "": not there
  std::vector<std::array<double, 2>> points;
  std::size_t hue = 0;   ///< colour, counted from 0 and repeated when there are more than the palette has
  std::size_t dash = 0;  ///< 0: full line; others: patterns, repeated likewise
  bool marks = false;    ///< points without a line
};

/// A horizontal line that says what a value means.
struct ChartLevel {
  double y;
  std::string name;
};

struct Chart {
  std::string name;  ///< of its file, without extension
  std::string title, subtitle;
  std::string x_label, y_label;  ///< with units
  bool log_x = true, log_y = true;
  bool staircase = false;  ///< a value holds up to the next point
  bool compact = false;    ///< half as wide, legend above: for phones, and two beside one another
  std::vector<ChartSeries> series;
  std::vector<ChartLevel> levels = {};
};

/// Points that are not finite, or not positive on a logarithmic axis, are left out; without any point the
/// picture says so.
std::string draw_chart(const Chart& chart);

}  // namespace talus::io
