#include "io/pictures/chart.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "io/pictures/detail/chart_style.hpp"
#include "io/pictures/detail/svg.hpp"

namespace talus::io {
namespace {

using detail::Svg;
namespace style = detail::style;
using Point = std::array<double, 2>;

constexpr double width = 980, height = 540;
constexpr double left = 96, right = 650, top = 84, bottom = 460;

std::string power_of_ten(int exponent) {
  if (exponent >= -2 && exponent <= 3) return fmt::format("{:g}", std::pow(10.0, exponent));
  static constexpr std::string_view digits[] = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  std::string text = exponent < 0 ? "10⁻" : "10";
  for (char digit : std::to_string(std::abs(exponent))) text += digits[digit - '0'];
  return text;
}

struct Tick {
  double value;
  std::string text;  ///< "" for a line without number
};

/// An axis from pixel `from` to pixel `to` that shows [low, high].
class Axis {
 public:
  Axis(bool logarithmic, double low, double high, double from, double to)
      : logarithmic_(logarithmic), from_(from), to_(to) {
    if (logarithmic)
      plan_decades(low, high);
    else
      plan_steps(low, high);
  }

  double place(double value) const {
    const double v = logarithmic_ ? std::log10(value) : value;
    return from_ + (v - low_) / (high_ - low_) * (to_ - from_);
  }
  const std::vector<Tick>& ticks() const { return ticks_; }

 private:
  /// Whole decades where there are two or more; else 1, 2, 5 of a decade.
  void plan_decades(double low, double high) {
    low_ = std::log10(low), high_ = std::log10(high);
    const bool few = high_ - low_ < 1.7;
    const double marks[] = {0, std::log10(2.0), std::log10(5.0)};
    const auto down = [&](double v) {
      double best = std::floor(v + 1e-9);
      if (few)
        for (double mark : marks)
          if (std::floor(v + 1e-9) + mark <= v + 1e-9) best = std::floor(v + 1e-9) + mark;
      return best;
    };
    const auto up = [&](double v) {
      if (few)
        for (double mark : marks)
          if (std::floor(v - 1e-9) + mark >= v - 1e-9) return std::floor(v - 1e-9) + mark;
      return std::ceil(v - 1e-9);
    };
    low_ = down(low_), high_ = up(high_);
    if (high_ - low_ < 0.1) high_ = low_ + 1;
    const int decades = static_cast<int>(std::ceil(high_) - std::floor(low_));
    const int stride = std::max(1, (decades + 9) / 10);
    for (int n = static_cast<int>(std::floor(low_)); n <= static_cast<int>(std::ceil(high_)); ++n)
      for (int digit = 1; digit < 10; ++digit) {
        const double v = n + std::log10(static_cast<double>(digit));
        if (v < low_ - 1e-9 || v > high_ + 1e-9 || (digit > 1 && decades > 6)) continue;
        std::string text;
        if (digit == 1 && n % stride == 0) text = power_of_ten(n);
        if (few && (digit == 2 || digit == 5)) text = small_number(digit, n);
        ticks_.push_back({std::pow(10.0, v), text});
      }
  }

  static std::string small_number(int digit, int exponent) {
    return exponent >= -3 && exponent <= 3 ? fmt::format("{:g}", digit * std::pow(10.0, exponent))
                                           : fmt::format("{}·{}", digit, power_of_ten(exponent));
  }

  void plan_steps(double low, double high) {
    if (high - low < 1e-12 * std::max(1.0, std::abs(high))) high = low + 1;
    const std::vector<double> values = detail::nice_ticks(low, high, 6);
    low_ = values.front(), high_ = values.back();
    for (double value : values) ticks_.push_back({value, fmt::format("{:.6g}", value)});
  }

  bool logarithmic_;
  double from_, to_;
  double low_ = 0, high_ = 1;
  std::vector<Tick> ticks_;
};

/// The points that the axes can show.
std::vector<Point> shown(const Chart& chart, const ChartSeries& series) {
  std::vector<Point> points;
  for (const Point& p : series.points)
    if (std::isfinite(p[0]) && std::isfinite(p[1]) && (!chart.log_x || p[0] > 0) &&
        (!chart.log_y || p[1] > 0))
      points.push_back(p);
  return points;
}

void draw_frame(Svg& svg, const Chart& chart, const Axis& x, const Axis& y) {
  for (const Tick& tick : x.ticks()) {
    const double at = x.place(tick.value);
    svg.line(at, top, at, bottom, {style::grid, tick.text.empty() ? 0.5 : 1.2});
    svg.text(at, bottom + 20, tick.text, {12, style::soft_ink, "middle"});
  }
  for (const Tick& tick : y.ticks()) {
    const double at = y.place(tick.value);
    svg.line(left, at, right, at, {style::grid, tick.text.empty() ? 0.5 : 1.2});
    svg.text(left - 8, at + 4, tick.text, {12, style::soft_ink, "end"});
  }
  svg.line(left, bottom, right, bottom, {style::soft_ink, 1});
  svg.line(left, top, left, bottom, {style::soft_ink, 1});
  svg.text((left + right) / 2, bottom + 48, chart.x_label, {13, style::ink, "middle", true});
  svg.text(28, (top + bottom) / 2, chart.y_label, {13, style::ink, "middle", true, -90});
}

void draw_levels(Svg& svg, const Chart& chart, const Axis& y) {
  for (const ChartLevel& level : chart.levels) {
    const double at = y.place(level.y);
    svg.line(left, at, right, at, {style::soft_ink, 1.2, "2 3"});
    svg.text(right + 6, at + 4, level.name, {11, style::soft_ink});
  }
}

void draw_series(Svg& svg, const Chart& chart, const ChartSeries& series, const Axis& x, const Axis& y) {
  const std::string_view colour = detail::hue(series.hue);
  std::vector<Point> line;
  for (const Point& p : shown(chart, series)) {
    const Point at{x.place(p[0]), y.place(p[1])};
    if (chart.staircase && !line.empty()) line.push_back({at[0], line.back()[1]});
    line.push_back(at);
  }
  if (chart.staircase && !line.empty()) line.push_back({right, line.back()[1]});
  svg.polyline(line, {colour, 2, detail::dashes(series.dash)});
  // Marks say where something was measured; where they would touch, the line says it.
  if (!chart.staircase && line.size() <= 40)
    for (const Point& at : line) svg.circle(at[0], at[1], 3.2, colour);
}

void draw_legend(Svg& svg, const Chart& chart) {
  const double x = right + (chart.levels.empty() ? 28 : 96);
  const double pitch =
      std::min(20.0, (bottom - top) / std::max<double>(1, static_cast<double>(chart.series.size())));
  for (std::size_t k = 0; k < chart.series.size(); ++k) {
    const ChartSeries& series = chart.series[k];
    const double y = top + 8 + static_cast<double>(k) * pitch;
    svg.line(x, y, x + 30, y, {detail::hue(series.hue), 2.4, detail::dashes(series.dash)});
    svg.text(x + 38, y + 4, series.name, {std::min(12.0, pitch), style::ink});
  }
}

}  // namespace

std::string draw_chart(const Chart& chart) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  Point low{infinity, infinity}, high{-infinity, -infinity};
  const auto widen = [&](std::size_t axis, double value) {
    low[axis] = std::min(low[axis], value);
    high[axis] = std::max(high[axis], value);
  };
  for (const ChartSeries& series : chart.series)
    for (const Point& p : shown(chart, series)) widen(0, p[0]), widen(1, p[1]);
  Svg svg(width, height);
  svg.text(left, 34, chart.title, {18, style::ink, "start", true});
  svg.text(left, 58, chart.subtitle, {13, style::soft_ink});
  if (!std::isfinite(low[0])) {
    svg.text((left + right) / 2, (top + bottom) / 2, "No data", {14, style::soft_ink, "middle"});
    return svg.finish();
  }
  Chart kept = chart;
  std::erase_if(kept.levels, [&](const ChartLevel& level) {
    return !std::isfinite(level.y) || (chart.log_y && level.y <= 0);
  });
  for (const ChartLevel& level : kept.levels) widen(1, level.y);
  const Axis x(chart.log_x, low[0], high[0], left, right), y(chart.log_y, low[1], high[1], bottom, top);
  draw_frame(svg, kept, x, y);
  draw_levels(svg, kept, y);
  for (const ChartSeries& series : kept.series) draw_series(svg, kept, series, x, y);
  draw_legend(svg, kept);
  return svg.finish();
}

}  // namespace talus::io
