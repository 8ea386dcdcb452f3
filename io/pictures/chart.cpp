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

/// Where things stand [px].
struct Layout {
  double width, height;
  double left, right, top, bottom;  ///< of the plot
  double y_label, x_label;          ///< of y: from the left; of x: below the plot
  double title_size, title_y, subtitle_y;
  bool legend_above;
};
constexpr Layout wide{980, 540, 96, 650, 84, 460, 28, 48, 18, 34, 58, false};
constexpr double legend_pitch = 18;

/// Entries of a legend in one row above a plot of that width, and the rows that all of them take.
double entry_width(const ChartSeries& series) {
  return 42 + detail::text_width(series.name, 12);
}
std::size_t legend_rows(const Chart& chart, double width) {
  std::size_t rows = 0;
  double used = width;
  for (const ChartSeries& series : chart.series) {
    if (series.name.empty()) continue;
    if (used + entry_width(series) > width) ++rows, used = 0;
    used += entry_width(series);
  }
  return rows;
}

Layout layout_of(const Chart& chart) {
  if (!chart.compact) return wide;
  Layout compact{480, 0, 66, 466, 0, 0, 16, 40, 15, 20, 38, true};
  const double legend = legend_pitch * static_cast<double>(legend_rows(chart, compact.right - compact.left));
  compact.top = (chart.subtitle.empty() ? 32 : 50) + legend + 6;
  compact.bottom = compact.top + 230;
  compact.height = compact.bottom + 50;
  return compact;
}

/// How an axis writes its powers of ten: all in one way.
enum class Powers { plain, raised };

Powers powers_between(int least, int most) {
  return least >= -3 && most <= 4 ? Powers::plain : Powers::raised;
}

std::string power_of_ten(int exponent, Powers powers) {
  if (powers == Powers::plain) return fmt::format("{:g}", std::pow(10.0, exponent));
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
    const Powers powers =
        powers_between(static_cast<int>(std::floor(low_)), static_cast<int>(std::ceil(high_)));
    for (int n = static_cast<int>(std::floor(low_)); n <= static_cast<int>(std::ceil(high_)); ++n)
      for (int digit = 1; digit < 10; ++digit) {
        const double v = n + std::log10(static_cast<double>(digit));
        if (v < low_ - 1e-9 || v > high_ + 1e-9 || (digit > 1 && decades > 6)) continue;
        std::string text;
        if (digit == 1 && n % stride == 0) text = power_of_ten(n, powers);
        if (few && (digit == 2 || digit == 5)) text = small_number(digit, n, powers);
        ticks_.push_back({std::pow(10.0, v), text});
      }
  }

  static std::string small_number(int digit, int exponent, Powers powers) {
    return powers == Powers::plain ? fmt::format("{:g}", digit * std::pow(10.0, exponent))
                                   : fmt::format("{}·{}", digit, power_of_ten(exponent, powers));
  }

  void plan_steps(double low, double high) {
    // Without an extent that numbers of this size can tell, one of a part of them: adding 1 would be lost on
    // large ones, and hides small ones.
    const double size = std::max(std::abs(low), std::abs(high));
    if (high - low <= 1e-12 * size) high = low + (size > 0 ? 0.1 * size : 1);
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

/// Parts of the picture, over axes that show its data.
class Drawing {
 public:
  Drawing(Svg& svg, const Chart& chart, const Layout& page, const Axis& x, const Axis& y)
      : svg_(svg), chart_(chart), page_(page), x_(x), y_(y) {}

  void frame() const {
    const auto& p = page_;
    for (const Tick& tick : x_.ticks()) {
      const double at = x_.place(tick.value);
      svg_.line(at, p.top, at, p.bottom, {style::grid, tick.text.empty() ? 0.5 : 1.2});
      svg_.text(at, p.bottom + 20, tick.text, {12, style::soft_ink, "middle"});
    }
    for (const Tick& tick : y_.ticks()) {
      const double at = y_.place(tick.value);
      svg_.line(p.left, at, p.right, at, {style::grid, tick.text.empty() ? 0.5 : 1.2});
      svg_.text(p.left - 8, at + 4, tick.text, {12, style::soft_ink, "end"});
    }
    svg_.line(p.left, p.bottom, p.right, p.bottom, {style::soft_ink, 1});
    svg_.line(p.left, p.top, p.left, p.bottom, {style::soft_ink, 1});
    svg_.text((p.left + p.right) / 2, p.bottom + p.x_label, chart_.x_label, {13, style::ink, "middle", true});
    svg_.text(p.y_label, (p.top + p.bottom) / 2, chart_.y_label, {13, style::ink, "middle", true, -90});
  }

  void levels() const {
    const auto& p = page_;
    for (const ChartLevel& level : chart_.levels) {
      const double at = y_.place(level.y);
      svg_.line(p.left, at, p.right, at, {style::soft_ink, 1.2, "2 3"});
      if (!p.legend_above) svg_.text(p.right + 6, at + 4, level.name, {11, style::soft_ink});
    }
  }

  /// Names of levels within the plot, over the curves: above their lines, or below where there is no room.
  void level_names() const {
    const auto& p = page_;
    for (const ChartLevel& level : chart_.levels) {
      if (!p.legend_above) continue;
      const double at = y_.place(level.y), base = at < p.top + 16 ? at + 14 : at - 5;
      const double length = detail::text_width(level.name, 11);
      svg_.rectangle(p.right - 8 - length, base - 10, length + 8, 13, "#ffffff");
      svg_.text(p.right - 4, base, level.name, {11, style::soft_ink, "end"});
    }
  }

  /// `place` in the order of drawing, of `count`: later curves are thinner, so that what lies under them is
  /// seen on both sides.
  void series(const ChartSeries& series, std::size_t place, std::size_t count) const {
    const std::string_view colour = detail::hue(series.hue);
    std::vector<Point> line;
    for (const Point& p : shown(chart_, series)) {
      const Point at{x_.place(p[0]), y_.place(p[1])};
      if (chart_.staircase && !line.empty()) line.push_back({at[0], line.back()[1]});
      line.push_back(at);
    }
    if (chart_.staircase && !line.empty()) line.push_back({page_.right, line.back()[1]});
    if (!series.marks) svg_.polyline(line, {colour, line_width(place, count), detail::dashes(series.dash)});
    // Marks say where something was measured; where they would touch, the line says it.
    if (series.marks || (!chart_.staircase && line.size() <= 40))
      for (const Point& at : line) svg_.circle(at[0], at[1], 3.2, colour);
  }

  void legend() const {
    const auto& p = page_;
    if (p.legend_above) return legend_above();
    const double x = p.right + (chart_.levels.empty() ? 28 : 96);
    const double pitch =
        std::min(20.0, (p.bottom - p.top) / std::max<double>(1, static_cast<double>(chart_.series.size())));
    for (std::size_t k = 0; k < chart_.series.size(); ++k)
      entry(chart_.series[k], x, p.top + 8 + static_cast<double>(k) * pitch, std::min(12.0, pitch));
  }

 private:
  double line_width(std::size_t place, std::size_t count) const {
    const double last = page_.legend_above ? 1.6 : 2;
    if (count < 2) return last;
    const double rest = static_cast<double>(count - 1 - place) / static_cast<double>(count - 1);
    return last + rest * std::min(2.4, 0.8 * static_cast<double>(count - 1));
  }

  void legend_above() const {
    double x = page_.left, y = page_.subtitle_y - (chart_.subtitle.empty() ? 4 : -14);
    for (const ChartSeries& series : chart_.series) {
      if (series.name.empty()) continue;
      if (x > page_.left && x + entry_width(series) > page_.right) x = page_.left, y += legend_pitch;
      entry(series, x, y, 12);
      x += entry_width(series);
    }
  }
  void entry(const ChartSeries& series, double x, double y, double size) const {
    const double length = page_.legend_above ? 20 : 30;
    if (series.marks)
      svg_.circle(x + length / 2, y, 3.2, detail::hue(series.hue));
    else
      svg_.line(x, y, x + length, y, {detail::hue(series.hue), 2.4, detail::dashes(series.dash)});
    svg_.text(x + length + (page_.legend_above ? 6 : 8), y + 4, series.name, {size, style::ink});
  }

  Svg& svg_;
  const Chart& chart_;
  const Layout& page_;
  const Axis &x_, &y_;
};

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
  const Layout page = layout_of(chart);
  Svg svg(page.width, page.height);
  svg.text(page.legend_above ? 2 : page.left, page.title_y, chart.title,
           {page.title_size, style::ink, "start", true});
  svg.text(page.legend_above ? 2 : page.left, page.subtitle_y, chart.subtitle, {13, style::soft_ink});
  if (!std::isfinite(low[0])) {
    svg.text((page.left + page.right) / 2, (page.top + page.bottom) / 2, "No data",
             {14, style::soft_ink, "middle"});
    return svg.finish();
  }
  Chart kept = chart;
  std::erase_if(kept.levels, [&](const ChartLevel& level) {
    return !std::isfinite(level.y) || (chart.log_y && level.y <= 0);
  });
  for (const ChartLevel& level : kept.levels) widen(1, level.y);
  // Above the highest level there is room for its name, which would hide curves elsewhere.
  if (page.legend_above && chart.log_y)
    for (const ChartLevel& level : kept.levels) widen(1, level.y * std::pow(high[1] / low[1], 0.12));
  const Axis x(chart.log_x, low[0], high[0], page.left, page.right);
  const Axis y(chart.log_y, low[1], high[1], page.bottom, page.top);
  const Drawing drawing(svg, kept, page, x, y);
  drawing.frame();
  drawing.levels();
  for (std::size_t k = 0; k < kept.series.size(); ++k) drawing.series(kept.series[k], k, kept.series.size());
  drawing.level_names();
  drawing.legend();
  return svg.finish();
}

}  // namespace talus::io
