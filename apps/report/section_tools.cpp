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

}  // namespace talus
