#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>

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
  std::size_t contacts = 0;  ///< one across a face of a periodic cell is drawn on both sides
};

constexpr double picture_side = 760, margin_left = 40, margin_right = 40, margin_top = 84, margin_bottom = 84;

ForceSlab slab_of(const Frame& frame, std::size_t walls, const ForcePicture& options) {
  ForceSlab slab{detail::cut_slab(frame, options.thickness), {}, 0, 0};
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
  slab.forces.insert(slab.forces.end(), others.begin(), others.end());
  // Strong chains on top; equal forces keep the order of the frame, so that the same frame gives the same
  // file.
  std::ranges::stable_sort(slab.forces, {}, &Force::normal);
  return slab;
}

struct HalfPlane {
  double nx, nz, position;  ///< nx x + nz z >= position
};

/// The ends of the border of `line` inside all of `inside`; empty when nothing is left of it.
std::optional<std::pair<Point, Point>> clipped(const HalfPlane& line, std::span<const HalfPlane> inside) {
  const double square = line.nx * line.nx + line.nz * line.nz;
  const Point origin{line.nx * line.position / square, line.nz * line.position / square};
  const Point along{-line.nz, line.nx};
  double begin = -std::numeric_limits<double>::infinity(), end = -begin;
  for (const HalfPlane& plane : inside) {
    const double slope = plane.nx * along.x + plane.nz * along.z;
    const double room = plane.position - plane.nx * origin.x - plane.nz * origin.z;
    if (std::abs(slope) < 1e-12) {
      if (room > 0) return std::nullopt;
    } else if (slope > 0) {
      begin = std::max(begin, room / slope);
    } else {
      end = std::min(end, room / slope);
    }
  }
  if (!(begin < end)) return std::nullopt;
  return std::pair{Point{origin.x + begin * along.x, origin.z + begin * along.z},
                   Point{origin.x + end * along.x, origin.z + end * along.z}};
}

void draw_walls(Svg& svg, const View& view, const Frame& frame, std::span<const Wall> walls) {
  std::vector<HalfPlane> cut;
  for (std::size_t k = 0; k < std::min(walls.size(), frame.walls.size()); ++k) {
    if (walls[k].surface() == nullptr && std::abs(walls[k].normal.y()) < 1e-9) {
      cut.push_back({walls[k].normal.x(), walls[k].normal.z(), frame.walls[k].position});
    }
  }
  for (std::size_t k = 0; k < cut.size(); ++k) {
    std::vector<HalfPlane> inside{
        {1, 0, view.x_low}, {-1, 0, -view.x_high}, {0, 1, view.z_low}, {0, -1, -view.z_high}};
    for (std::size_t j = 0; j < cut.size(); ++j) {
      if (j != k) inside.push_back(cut[j]);
    }
    if (const auto ends = clipped(cut[k], inside)) {
      svg.line(view.x(ends->first.x), view.y(ends->first.z), view.x(ends->second.x), view.y(ends->second.z),
               {style::ink, 3});
    }
  }
}

/// The faces of a periodic cell along x and z.
void draw_cell(Svg& svg, const View& view, const Domain& domain) {
  const Vec3 &low = domain.low, high = low + domain.edges();
  for (const double x : {low.x(), high.x()})
    if (domain.cell.xx > 0)
      svg.line(view.x(x), view.y(view.z_low), view.x(x), view.y(view.z_high), {style::soft_ink, 1});
  for (const double z : {low.z(), high.z()})
    if (domain.cell.zz > 0)
      svg.line(view.x(view.x_low), view.y(z), view.x(view.x_high), view.y(z), {style::soft_ink, 1});
}

/// Width of a line [px]: proportional to the force, five mean forces are as wide as 0.6 mean radii.
double line_width(double normal, const ForceSlab& slab, const View& view) {
  return std::clamp(normal / slab.mean_force, 0.0, 5.0) / 5 * 0.6 * slab.mean_radius * view.scale;
}

std::string_view line_colour(double normal, double mean) {
  return normal < mean ? "#e8a27c" : normal < 2 * mean ? "#d3652f" : "#8f2d0c";
}

/// A straight line between two points of the picture [px].
struct Segment {
  double x1, y1, x2, y2;
};

void draw_force(Svg& svg, const Segment& at, double normal, const ForceSlab& slab, const View& view) {
  const double w = line_width(normal, slab, view);
  if (w < 0.05) return;
  svg.line(at.x1, at.y1, at.x2, at.y2, {line_colour(normal, slab.mean_force), w});
}

void draw_legend(Svg& svg, const ForceSlab& slab, const View& view, double top) {
  double x = margin_left + detail::draw_scale(svg, view, top + 18, 16) + 60;
  if (!(slab.mean_force > 0)) return;
  for (const double multiple : {0.5, 1.0, 2.0, 4.0}) {
    draw_force(svg, {x, top + 18, x + 36, top + 18}, multiple * slab.mean_force, slab, view);
    svg.text(x, top + 38, (multiple == 1 ? "mean " : "") + detail::with_unit(multiple * slab.mean_force, "N"),
             {12, style::ink});
    x += 92;
  }
}

}  // namespace

std::string draw_forces(const Frame& frame, std::span<const Wall> walls, const ForcePicture& options) {
  const ForceSlab slab = slab_of(frame, walls.size(), options);
  const View view = detail::view_of(frame, slab, picture_side, margin_left, margin_top);
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
  svg.begin_group(fmt::format(R"(stroke="{}" stroke-width="0.7")", style::grain_edge));
  for (const std::size_t k : slab.grains) {
    svg.circle(view.x(frame.x[k].x()), view.y(frame.x[k].z()), frame.radius[k] * view.scale,
               style::grain_fill);
  }
  svg.end_group();
  svg.begin_group(R"(stroke-linecap="round")");
  for (const Force& force : slab.forces) {
    draw_force(svg, {view.x(force.from.x), view.y(force.from.z), view.x(force.to.x), view.y(force.to.z)},
               force.normal, slab, view);
  }
  svg.end_group();
  draw_walls(svg, view, frame, walls);
  draw_cell(svg, view, frame.domain);
  draw_legend(svg, slab, view, bottom + 16);
  return svg.finish();
}

}  // namespace talus::io
