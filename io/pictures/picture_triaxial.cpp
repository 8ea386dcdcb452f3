#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "io/pictures/detail/svg.hpp"
#include "io/pictures/picture.hpp"

namespace talus::io {
namespace {

using detail::Letters;
using detail::Svg;
namespace style = detail::style;

constexpr double width = 720, height = 640;
/// Of steps that missed their tolerance.
constexpr std::string_view missed_colour = style::ink;
constexpr double left = 84, right = width - 28;

struct Row {
  double strain;         ///< axial, compression positive [%]
  double stress_ratio;   ///< q/p
  double volume_strain;  ///< dilation positive [%]
  bool converged;        ///< of its step
};

/// One diagram: where it stands, what it shows.
struct Panel {
  double top, bottom;  ///< [px]
  double Row::*value;
  std::string_view label;
  std::string_view colour;
};

std::vector<Row> rows_of(std::span<const TriaxialReport> reports, const TriaxialPicture& options) {
  std::vector<Row> rows;
  for (const TriaxialReport& report : reports) {
    if (!options.stage.empty() && report.stage != options.stage) continue;
    const Row row{-100 * report.strain.at(static_cast<std::size_t>(options.axis)), report.q_over_p,
                  100 * report.strain_volume, report.converged};
    if (std::isfinite(row.strain) && std::isfinite(row.stress_ratio) && std::isfinite(row.volume_strain)) {
      rows.push_back(row);
    }
  }
  return rows;
}

/// Ticks over all values of a column and zero; an interval of some width even if all values are the same.
std::vector<double> ticks_of(const std::vector<Row>& rows, double Row::*value, int wanted) {
  double low = 0, high = 0;
  for (const Row& row : rows) {
    low = std::min(low, row.*value);
    high = std::max(high, row.*value);
  }
  if (high - low < 1e-9) high = low + 1;
  return detail::nice_ticks(low, high, wanted);
}

std::string tick_text(double value, double step) {
  const int decimals = std::max(0, static_cast<int>(std::ceil(-std::log10(step) - 1e-9)));
  const std::string text = fmt::format("{:.{}f}", value, decimals);
  return text.starts_with('-') ? "\u2212" + text.substr(1) : text;
}

double place(double value, const std::vector<double>& ticks, double from, double to) {
  return from + (value - ticks.front()) / (ticks.back() - ticks.front()) * (to - from);
}

void draw_panel(Svg& svg, const Panel& panel, const std::vector<Row>& rows,
                const std::vector<double>& strain_ticks) {
  const std::vector<double> ticks = ticks_of(rows, panel.value, 5);
  for (const double tick : strain_ticks) {
    const double x = place(tick, strain_ticks, left, right);
    svg.line(x, panel.top, x, panel.bottom, {style::grid, 1});
  }
  for (const double tick : ticks) {
    const double y = place(tick, ticks, panel.bottom, panel.top);
    const bool zero = std::abs(tick) < 1e-12;
    svg.line(left, y, right, y, {zero ? style::soft_ink : style::grid, 1});
    svg.text(left - 8, y + 4, tick_text(tick, ticks[1] - ticks[0]), {12, style::soft_ink, "end"});
  }
  svg.text(26, (panel.top + panel.bottom) / 2, panel.label, {13, panel.colour, "middle", true, -90});
  std::vector<std::array<double, 2>> points;
  for (const Row& row : rows) {
    points.push_back({place(row.strain, strain_ticks, left, right),
                      place(row.*panel.value, ticks, panel.bottom, panel.top)});
  }
  svg.polyline(points, {panel.colour, 2});
  for (std::size_t k = 0; k < rows.size(); ++k)
    if (!rows[k].converged) svg.circle(points[k][0], points[k][1], 2.5, missed_colour);
  if (!points.empty()) svg.circle(points.back()[0], points.back()[1], 3.5, panel.colour);
}

/// Peak and last value of the steps that converged: what others give is no result.
std::string findings(const std::vector<Row>& rows) {
  std::vector<Row> sound;
  std::ranges::copy_if(rows, std::back_inserter(sound), &Row::converged);
  if (sound.empty()) return "no step converged";
  const Row& peak = *std::ranges::max_element(sound, {}, &Row::stress_ratio);
  const Row& last = sound.back();
  return fmt::format("peak q/p = {:.3f} at {:.3g} %;  at {:.3g} %: q/p = {:.3f}, volume strain {:+.3g} %",
                     peak.stress_ratio, peak.strain, last.strain, last.stress_ratio, last.volume_strain);
}

}  // namespace

std::string draw_triaxial(std::span<const TriaxialReport> reports, const TriaxialPicture& options) {
  const std::vector<Row> rows = rows_of(reports, options);
  Svg svg(width, height);
  svg.text(left, 32,
           options.stage.empty() ? "Stress and strain"
                                 : fmt::format("Stress and strain, stage \u201c{}\u201d", options.stage),
           {18, style::ink, "start", true});
  svg.text(left, 54, rows.empty() ? "No data yet" : findings(rows), {13, style::soft_ink});
  if (const auto missed = std::ranges::count(rows, false, &Row::converged); missed > 0)
    svg.text(left, 72, fmt::format("\u25cf {} of {} steps drawn missed their tolerance", missed, rows.size()),
             {12, missed_colour});
  const std::vector<double> strain_ticks = ticks_of(rows, &Row::strain, 8);
  draw_panel(svg, {80, 320, &Row::stress_ratio, "q / p  [1]", style::blue}, rows, strain_ticks);
  draw_panel(svg, {350, 570, &Row::volume_strain, "volume strain, dilation +  [%]", style::orange}, rows,
             strain_ticks);
  for (const double tick : strain_ticks) {
    svg.text(place(tick, strain_ticks, left, right), 590, tick_text(tick, strain_ticks[1] - strain_ticks[0]),
             {12, style::soft_ink, "middle"});
  }
  svg.text((left + right) / 2, 616,
           fmt::format("axial strain along {}, compression positive  [%]", "xyz"[options.axis]),
           {13, style::ink, "middle", true});
  return svg.finish();
}

}  // namespace talus::io
