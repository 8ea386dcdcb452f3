#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "io/files/detail/with_unit.hpp"
#include "io/pictures/detail/chart_style.hpp"
#include "io/pictures/detail/slab.hpp"
#include "io/pictures/detail/svg.hpp"
#include "io/pictures/picture.hpp"

namespace talus::io {
namespace {

using detail::Svg;
using detail::View;
namespace style = detail::style;

constexpr double picture_side = 560, margin_left = 40, margin_right = 40, margin_top = 84, margin_bottom = 72;

/// Slow to fast, told apart in print.
constexpr std::array<std::string_view, 8> speeds{"#f4f6f8", "#d3e3f2", "#a8cbe6", "#76aed6",
                                                 "#4a8cc2", "#2a69a6", "#174a80", "#0a2c55"};

/// Speed that nineteen of twenty grains of the slab do not exceed [m/s]: the fastest one would bleach the
/// rest.
double usual_speed(const Frame& frame, const detail::Slab& slab) {
  std::vector<double> all;
  for (const std::size_t k : slab.grains) all.push_back(frame.u[k].norm());
  if (all.empty()) return 0;
  const std::size_t place = (all.size() - 1) * 19 / 20;
  std::ranges::nth_element(all, all.begin() + static_cast<std::ptrdiff_t>(place));
  return all[place];
}

std::string_view speed_colour(double speed, double usual) {
  if (!(usual > 0)) return speeds.front();
  const auto place = static_cast<std::size_t>(std::clamp(speed / usual, 0.0, 1.0) * speeds.size());
  return speeds[std::min(place, speeds.size() - 1)];
}

/// A page with a title, the grains of a slab in their colours, and a legend that begins at (x, y).
struct GrainPage {
  std::string title;
  std::span<const Wall> walls;
  GrainShapes shapes;
  std::function<std::string_view(std::size_t)> colour;
  std::function<void(Svg&, const View&, std::size_t)> over;  ///< on a grain
  std::function<void(Svg&, double x, double y)> legend;
};

std::string draw_page(const Frame& frame, const detail::Slab& slab, const GrainPage& page) {
  const std::vector<detail::Cut> cuts = detail::cut_walls(frame, page.walls, slab);
  const View view = detail::view_of(frame, slab, cuts, {picture_side, margin_left, margin_top});
  const double bottom = margin_top + view.height();
  Svg svg(margin_left + std::max(480.0, view.width()) + margin_right, bottom + margin_bottom);
  svg.text(margin_left, 34,
           fmt::format("{}, stage \u201c{}\u201d, t = {}", page.title, frame.stage,
                       detail::with_unit(frame.time, "s")),
           {18, style::ink, "start", true});
  svg.text(margin_left, 56,
           fmt::format("slab of {} about y = {}, seen along y: {} of {} grains",
                       detail::with_unit(2 * slab.half, "m"), detail::with_unit(slab.middle, "m"),
                       slab.grains.size(), slab.sample.grains),
           {13, style::soft_ink});
  // The nearest to the eye on top; equal ones keep the order of the frame, for the same file each time.
  std::vector<SeenBall> balls;
  for (const std::size_t k : slab.grains) add_balls(frame, page.shapes, k, balls);
  std::ranges::stable_sort(balls, std::ranges::greater{}, [](const SeenBall& b) { return b.centre.y(); });
  svg.begin_group(fmt::format(R"(stroke="{}" stroke-width="0.4")", style::grain_edge));
  for (const auto& [centre, radius, grain] : balls) {
    svg.circle(view.x(centre.x()), view.y(centre.z()), radius * view.scale, page.colour(grain));
    if (page.over && !page.shapes.clump) page.over(svg, view, grain);
  }
  if (page.over && page.shapes.clump)  // balls of others would hide what is on a grain
    for (const std::size_t k : slab.grains) page.over(svg, view, k);
  svg.end_group();
  detail::draw_walls(svg, view, cuts);
  detail::draw_cell(svg, view, frame.domain);
  const double scale = detail::draw_scale(svg, view, bottom + 22, 8);
  page.legend(svg, margin_left + scale + 48, bottom + 22);
  return svg.finish();
}

/// From the centre along the velocity, as long as a diameter where the speed is the usual one.
void draw_arrow(Svg& svg, const View& view, const Frame& frame, std::size_t k, double usual) {
  const double speed = frame.u[k].norm();
  if (!(usual > 0 && speed > 0.05 * usual)) return;
  const Vec3 end = frame.x[k] + 2 * frame.radius[k] * std::min(speed / usual, 1.0) / speed * frame.u[k];
  svg.line(view.x(frame.x[k].x()), view.y(frame.x[k].z()), view.x(end.x()), view.y(end.z()), {"#e0661f", 1});
}

}  // namespace

std::string draw_velocities(const Frame& frame, const GrainPicture& options) {
  const detail::Slab slab = detail::cut_slab(frame, options.thickness, options.sample);
  const double usual = usual_speed(frame, slab);
  GrainPage page;
  page.title = "Velocities";
  page.walls = options.walls;
  page.shapes = options.shapes;
  page.colour = [&](std::size_t k) { return speed_colour(frame.u[k].norm(), usual); };
  page.over = [&](Svg& svg, const View& view, std::size_t k) { draw_arrow(svg, view, frame, k, usual); };
  page.legend = [&](Svg& svg, double x, double y) {
    if (!(usual > 0)) return svg.text(x, y + 4, "at rest", {12, style::ink});
    for (std::size_t c = 0; c < speeds.size(); ++c)
      svg.rectangle(x + 26 * static_cast<double>(c), y - 8, 26, 14, speeds[c]);
    svg.text(x, y + 22, "0", {12, style::ink});
    svg.text(x + 26 * speeds.size(), y + 22, detail::with_unit(usual, "m/s") + " and more",
             {12, style::ink, "middle"});
  };
  return draw_page(frame, slab, page);
}

std::string draw_materials(const Frame& frame, std::span<const std::string> names,
                           const GrainPicture& options) {
  const detail::Slab slab = detail::cut_slab(frame, options.thickness, options.sample);
  const auto material = [&](std::size_t k) {
    return frame.material.empty() ? std::size_t{0} : static_cast<std::size_t>(frame.material[k]);
  };
  GrainPage page;
  page.title = "Materials";
  page.walls = options.walls;
  page.shapes = options.shapes;
  page.colour = [&](std::size_t k) { return detail::hue(material(k)); };
  page.legend = [&](Svg& svg, double x, double y) {
    std::vector<std::size_t> count(std::max<std::size_t>(names.size(), 1), 0);
    for (const std::size_t k : slab.grains)
      if (material(k) < count.size()) ++count[material(k)];
    for (std::size_t m = 0; m < count.size(); ++m) {
      if (count[m] == 0) continue;
      const std::string name = fmt::format("{} ({})", m < names.size() ? names[m] : "grains", count[m]);
      svg.circle(x + 6, y, 6, detail::hue(m));
      svg.text(x + 18, y + 4, name, {12, style::ink});
      x += 18 + detail::text_width(name, 12) + 24;
    }
  };
  return draw_page(frame, slab, page);
}

}  // namespace talus::io
