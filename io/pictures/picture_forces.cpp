#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <vector>

#include "io/files/detail/with_unit.hpp"
#include "io/pictures/detail/slab.hpp"
#include "io/pictures/detail/svg.hpp"
#include "io/pictures/picture.hpp"
#include "io/results/detail/body_index.hpp"

namespace talus::io {
namespace {

using detail::Svg;
using detail::View;
namespace style = detail::style;

/// A point of the picture's plane [m].
struct Point {
  double x, z;
};

struct Force {
  Point from, to;
  double normal;  ///< [N]
};

/// What is seen: the grains of the slab and the forces between them, weak ones first.
struct ForceSlab : detail::Slab {
  std::vector<Force> forces;
  double mean_force = 0;     ///< of `forces` [N]
  double unit = 0;           ///< what widths of lines are measured by [N]: the mean force, or more
  std::size_t contacts = 0;  ///< one across a face of a periodic cell is drawn on both sides
};

constexpr double picture_side = 760, margin_left = 40, margin_right = 40, margin_top = 84, margin_bottom = 84;

/// Force that the scene's load puts on a grain of this radius [N].
double grain_force(const GrainLoad& load, double radius) {
  return std::max(load.pressure * 4 * radius * radius,
                  load.weight * 4 / 3 * std::numbers::pi * radius * radius * radius);
}

ForceSlab slab_of(const Frame& frame, std::size_t walls, const ForcePicture& options) {
  ForceSlab slab{detail::cut_slab(frame, options.thickness, options.sample), {}, 0, 0, 0};
  std::vector<Force> others;
  const auto inside = [&](std::size_t k) { return slab.holds(frame.x[k]); };
  const detail::BodyIndex index(frame.id);
  for (std::size_t k = 0; k < frame.contact_bodies.size(); ++k) {
    const auto [first, second] = frame.contact_bodies[k];
    const std::size_t a = index.at(first);
    if (second < 0 && detail::wall_index(second) >= walls) {
      throw std::invalid_argument(
          fmt::format("frame: a contact names wall {}, there are {}", detail::wall_index(second), walls));
    }
    const std::size_t b = second < 0 ? a : index.at(second);
    if (!inside(a) || !inside(b)) continue;
    const Vec3 &begin = frame.x[a], &other = second < 0 ? frame.contact_point[k] : frame.x[b];
    const Vec3 end = frame.domain.image_near(begin, other);
    const double normal = frame.contact_force[k].dot(frame.contact_normal[k]);
    slab.forces.push_back({{begin.x(), begin.z()}, {end.x(), end.z()}, normal});
    if (const Vec3 shift = other - end; second >= 0 && shift.norm() > frame.radius[a])
      others.push_back({{begin.x() + shift.x(), begin.z() + shift.z()}, {other.x(), other.z()}, normal});
  }
  slab.contacts = slab.forces.size();
  for (const Force& force : slab.forces) slab.mean_force += force.normal;
  if (!slab.forces.empty()) slab.mean_force /= static_cast<double>(slab.forces.size());
  constexpr double least_part = 0.01;
  slab.unit = std::max(slab.mean_force, least_part * grain_force(options.load, slab.sample.mean_radius));
  slab.forces.insert(slab.forces.end(), others.begin(), others.end());
  // Strong chains on top; equal forces keep the order of the frame, so that the same frame gives the same
  // file.
  std::ranges::stable_sort(slab.forces, {}, &Force::normal);
  return slab;
}

/// Width of a line [px]: proportional to the force, five units are as wide as 0.6 mean radii, if that is not
/// too wide for the page.
double line_width(double normal, const ForceSlab& slab, const View& view) {
  constexpr double widest = 14;
  return std::clamp(normal / slab.unit, 0.0, 5.0) / 5 *
         std::min(0.6 * slab.sample.mean_radius * view.scale, widest);
}

/// Forces far below those of the scene's load are what remains where nothing presses any more, and no chains.
bool is_unloaded(const ForceSlab& slab) {
  return slab.unit > slab.mean_force;
}

std::string_view line_colour(double normal, double unit) {
  return normal < unit ? "#e8a27c" : normal < 2 * unit ? "#d3652f" : "#8f2d0c";
}

/// A straight line between two points of the picture [px].
struct Segment {
  double x1, y1, x2, y2;
};

void draw_force(Svg& svg, const Segment& at, double normal, const ForceSlab& slab, const View& view) {
  const double w = line_width(normal, slab, view);
  if (w < 0.05) return;
  svg.line(at.x1, at.y1, at.x2, at.y2, {line_colour(normal, slab.unit), w});
}

void draw_legend(Svg& svg, const ForceSlab& slab, const View& view, double top) {
  double x = margin_left + detail::draw_scale(svg, view, top + 18, 16) + 48;
  if (!(slab.unit > 0)) return;
  for (const double multiple : {0.5, 1.0, 2.0, 4.0}) {
    const std::string name =
        (multiple == 1 && !is_unloaded(slab) ? "mean " : "") + detail::with_unit(multiple * slab.unit, "N");
    draw_force(svg, {x, top + 18, x + 36, top + 18}, multiple * slab.unit, slab, view);
    svg.text(x, top + 38, name, {12, style::ink});
    x += std::max(60.0, detail::text_width(name, 12) + 18);
  }
}

}  // namespace

std::string draw_forces(const Frame& frame, std::span<const Wall> walls, const ForcePicture& options) {
  const ForceSlab slab = slab_of(frame, walls.size(), options);
  const std::vector<detail::Cut> cuts = detail::cut_walls(frame, walls, slab);
  const View view = detail::view_of(frame, slab, cuts, {picture_side, margin_left, margin_top});
  const double inner_width = std::max(480.0, view.width());
  const double bottom = margin_top + view.height();
  Svg svg(margin_left + inner_width + margin_right, bottom + margin_bottom);
  svg.text(margin_left, 34,
           fmt::format("Normal forces, stage \u201c{}\u201d, step {}, t = {}", frame.stage, frame.step,
                       detail::with_unit(frame.time, "s")),
           {18, style::ink, "start", true});
  svg.text(margin_left, 56,
           fmt::format("slab of {} about y = {}, seen along y: {} grains, {} contacts",
                       detail::with_unit(2 * slab.half, "m"), detail::with_unit(slab.middle, "m"),
                       slab.grains.size(), slab.contacts),
           {13, style::soft_ink});
  if (slab.contacts > 0 && is_unloaded(slab))
    svg.text(margin_left, 74,
             fmt::format("hardly loaded: the mean force is {}, the scene's load puts some {} on a grain",
                         detail::with_unit(slab.mean_force, "N"),
                         detail::with_unit(grain_force(options.load, slab.sample.mean_radius), "N")),
             {12, style::soft_ink});
  svg.begin_group(fmt::format(R"(stroke="{}" stroke-width="0.7")", style::grain_edge));
  std::vector<SeenBall> balls;
  for (const std::size_t k : slab.grains) add_balls(frame, options.shapes, k, balls);
  for (const SeenBall& ball : balls)
    svg.circle(view.x(ball.centre.x()), view.y(ball.centre.z()), ball.radius * view.scale, style::grain_fill);
  svg.end_group();
  svg.begin_group(R"(stroke-linecap="round")");
  for (const Force& force : slab.forces) {
    draw_force(svg, {view.x(force.from.x), view.y(force.from.z), view.x(force.to.x), view.y(force.to.z)},
               force.normal, slab, view);
  }
  svg.end_group();
  detail::draw_walls(svg, view, cuts);
  detail::draw_cell(svg, view, frame.domain);
  draw_legend(svg, slab, view, bottom + 16);
  return svg.finish();
}

}  // namespace talus::io
