#include <algorithm>
#include <cmath>

#include "apps/report/sections.hpp"

namespace talus {

std::vector<std::array<double, 2>> thinned(std::span<const double> x, std::span<const double> y,
                                           Thinned how) {
  constexpr std::size_t most = 500;  // a point a pixel of the plot
  const std::size_t rows = std::min(x.size(), y.size());
  const std::size_t stretch = (rows + most - 1) / most;
  std::vector<std::array<double, 2>> points;
  for (std::size_t begin = 0; begin < rows; begin += stretch) {
    const std::size_t end = std::min(begin + stretch, rows);
    std::size_t k = end - 1;
    if (how == Thinned::largest)
      for (std::size_t at = begin; at < end; ++at)
        if (y[at] > y[k] || !std::isfinite(y[k])) k = at;
    points.push_back({x[k], y[k]});
  }
  return points;
}

io::Chart small_chart(const std::string& title, const std::string& x_label, const std::string& y_label,
                      bool log_y) {
  io::Chart chart{
      .name = "", .title = title, .subtitle = "", .x_label = x_label, .y_label = y_label, .series = {}};
  chart.log_x = false;
  chart.log_y = log_y;
  chart.compact = true;
  return chart;
}

void add_curve(io::Chart& chart, const std::string& name, std::span<const double> x,
               std::span<const double> y) {
  const std::size_t k = chart.series.size();
  if (k < most_curves) chart.series.push_back({name, thinned(x, y, Thinned::evenly), k});
}

void add_figure(io::HtmlSection& section, const io::Chart& chart, std::string caption) {
  if (!chart.series.empty()) section.figures.push_back({io::draw_chart(chart), std::move(caption)});
}

std::vector<double> scaled(std::span<const double> values, double factor) {
  std::vector<double> result(values.begin(), values.end());
  for (double& value : result) value *= factor;
  return result;
}

bool any_value(std::span<const double> values) {
  return std::ranges::any_of(values, [](double value) { return value != 0; });
}

ByName by_name(const io::TableColumns& table) {
  ByName result;
  for (std::size_t k = 0; k < table.texts.size(); ++k) {
    auto& columns = result.values[table.texts[k]];
    if (columns.empty()) result.names.push_back(table.texts[k]);
    for (const auto& [name, numbers] : table.numbers) columns[name].push_back(numbers[k]);
  }
  return result;
}

}  // namespace talus
