#include <fmt/format.h>

#include <cmath>
#include <iterator>

#include "io/pictures/chart.hpp"
#include "io/pictures/detail/chart_style.hpp"

namespace talus::io {
namespace {

/// A text as gnuplot reads it between single quotes.
std::string quoted(const std::string& text) {
  std::string out = "'";
  for (const char c : text) {
    out += c;
    if (c == '\'') out += c;
  }
  return out + "'";
}

std::string plot_of(const Chart& chart, const ChartSeries& series) {
  std::string rows = "1";
  for (const auto& [column, cell] : series.where)
    rows += fmt::format(" && strcol({}) eq {}", quoted(column), quoted(cell));
  const std::string_view dashes = detail::dashes(series.dash);
  std::string dash_type = "1";
  if (!dashes.empty())
    dash_type = fmt::format("({})", [&] {
      std::string list;
      for (const char c : dashes) list += c == ' ' ? ',' : c;
      return list;
    }());
  return fmt::format(
      "{} using ({} ? column({}) : NaN):(column({})) with {} linecolor rgb '{}' linewidth 2 dashtype {} "
      "title {}",
      quoted(series.table.empty() ? chart.table : series.table), rows, quoted(chart.x_column),
      quoted(chart.y_column), chart.staircase ? "steps" : "linespoints pointtype 7 pointsize 0.4",
      detail::hue(series.hue), dash_type, quoted(series.name));
}

}  // namespace

std::string gnuplot_script(std::span<const Chart> charts) {
  std::string out =
      "# gnuplot plot.gp: draws the tables of this folder, NAME.gnuplot.svg for every NAME.svg.\n"
      "set datafile separator comma\n"
      "set key autotitle columnheader outside right top noenhanced\n"
      "set grid\n"
      "set terminal svg size 980,540 noenhanced background rgb 'white'\n";
  for (const Chart& chart : charts) {
    fmt::format_to(std::back_inserter(out), "\nset output {}\nset title {}\nset xlabel {}\nset ylabel {}\n",
                   quoted(chart.name + ".gnuplot.svg"), quoted(chart.title), quoted(chart.x_label),
                   quoted(chart.y_label));
    out += chart.log_x ? "set logscale x\nset format x '%g'\n" : "unset logscale x\nset format x '%g'\n";
    out += chart.log_y ? "set logscale y\nset format y '%g'\n" : "unset logscale y\nset format y '%g'\n";
    std::string plots;
    for (const ChartSeries& series : chart.series) {
      if (!plots.empty()) plots += ", \\\n     ";
      plots += plot_of(chart, series);
    }
    for (const ChartLevel& level : chart.levels) {
      if (!(level.y > 0) && chart.log_y) continue;
      if (!plots.empty()) plots += ", \\\n     ";
      plots += fmt::format("{} linecolor rgb '#66727f' dashtype (2,3) title {}", level.y, quoted(level.name));
    }
    if (!plots.empty()) out += "plot " + plots + "\n";
  }
  return out;
}

}  // namespace talus::io
