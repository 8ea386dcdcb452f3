#include "io/pictures/detail/slab.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "io/files/detail/with_unit.hpp"
#include "io/pictures/detail/chart_style.hpp"
#include "io/results/wall_triangles.hpp"
#include "runtime/graph/one_rank.hpp"

namespace talus::io::detail {

Slab empty_slab(const SampleExtent& sample, double thickness) {
  Slab slab;
  slab.sample = sample;
  if (sample.grains == 0) return slab;
  slab.middle = (sample.y_low + sample.y_high) / 2;
  slab.half = half_of_slab(thickness, sample.mean_radius);
  return slab;
}

Slab cut_slab(const Frame& frame, double thickness, const std::optional<SampleExtent>& sample) {
  Slab slab = empty_slab(sample ? *sample : sample_extent(frame, graph::one_rank()), thickness);
  for (std::size_t k = 0; k < frame.id.size(); ++k) {
    if (slab.holds(frame.x[k])) slab.grains.push_back(k);
  }
  return slab;
}

std::vector<Cut> cut_walls(const Frame& frame, std::span<const Wall> walls, const Slab& slab) {
  std::vector<Cut> cuts;
  for (const std::vector<Triangle>& wall : wall_triangles(walls, frame.walls, slab.sample.box))
    for (const Triangle& triangle : wall) {
      std::array<Vec3, 3> ends;
      std::size_t found = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3 &a = triangle[k], &b = triangle[(k + 1) % 3];
        const double at_a = a.y() - slab.middle, at_b = b.y() - slab.middle;
        if ((at_a < 0) != (at_b < 0)) ends[found++] = a + at_a / (at_a - at_b) * (b - a);
      }
      if (found == 2) cuts.push_back({ends[0].x(), ends[0].z(), ends[1].x(), ends[1].z()});
    }
  return cuts;
}

View view_of(const Frame& frame, const Slab& slab, std::span<const Cut> walls, const Placement& at) {
  double x_low = std::numeric_limits<double>::infinity(), x_high = -x_low, z_low = x_low, z_high = -x_low;
  for (const std::size_t k : slab.grains) {
    x_low = std::min(x_low, frame.x[k].x() - frame.radius[k]);
    x_high = std::max(x_high, frame.x[k].x() + frame.radius[k]);
    z_low = std::min(z_low, frame.x[k].z() - frame.radius[k]);
    z_high = std::max(z_high, frame.x[k].z() + frame.radius[k]);
  }
  const Domain& domain = frame.domain;
  const Vec3 far = domain.low + domain.edges();
  if (domain.cell.xx > 0) x_low = std::min(x_low, domain.low.x()), x_high = std::max(x_high, far.x());
  if (domain.cell.zz > 0) z_low = std::min(z_low, domain.low.z()), z_high = std::max(z_high, far.z());
  if (!(x_low < x_high)) x_low = 0, x_high = 1;
  if (!(z_low < z_high)) z_low = 0, z_high = 1;
  // Of the longer side: a drum that is half full is seen whole.
  const double reach = 0.5 * std::max(x_high - x_low, z_high - z_low);
  const double x_least = x_low - reach, x_most = x_high + reach, z_least = z_low - reach,
               z_most = z_high + reach;
  for (const Cut& wall : walls)
    for (const auto& [x, z] : {std::pair{wall.x1, wall.z1}, std::pair{wall.x2, wall.z2}}) {
      x_low = std::min(x_low, std::max(x, x_least)), x_high = std::max(x_high, std::min(x, x_most));
      z_low = std::min(z_low, std::max(z, z_least)), z_high = std::max(z_high, std::min(z, z_most));
    }
  const double border = slab.grains.empty() ? 0 : slab.sample.mean_radius;
  x_low -= border, z_low -= border, x_high += border, z_high += border;
  const double scale = at.side / std::max(x_high - x_low, z_high - z_low);
  return {x_low, z_low, x_high, z_high, scale, at.left, at.top};
}

void draw_walls(Svg& svg, const View& view, std::span<const Cut> walls) {
  svg.begin_group(R"(stroke-linecap="round")");
  for (const Cut& wall : walls) {
    // The part within the view (Liang and Barsky).
    double begin = 0, end = 1;
    const auto keep = [&](double from, double to, double low, double high) {
      const double d = to - from;
      if (d == 0) {
        if (from < low || from > high) end = -1;
        return;
      }
      const double a = (low - from) / d, b = (high - from) / d;
      begin = std::max(begin, std::min(a, b)), end = std::min(end, std::max(a, b));
    };
    keep(wall.x1, wall.x2, view.x_low, view.x_high);
    keep(wall.z1, wall.z2, view.z_low, view.z_high);
    if (!(begin < end)) continue;
    const double dx = wall.x2 - wall.x1, dz = wall.z2 - wall.z1;
    svg.line(view.x(wall.x1 + begin * dx), view.y(wall.z1 + begin * dz), view.x(wall.x1 + end * dx),
             view.y(wall.z1 + end * dz), {style::ink, 3});
  }
  svg.end_group();
}

void draw_cell(Svg& svg, const View& view, const Domain& domain) {
  const Vec3 &low = domain.low, high = low + domain.edges();
  const Stroke faces{style::soft_ink, 1};
  for (const double x : {low.x(), high.x()})
    if (domain.cell.xx > 0) svg.line(view.x(x), view.y(view.z_low), view.x(x), view.y(view.z_high), faces);
  for (const double z : {low.z(), high.z()})
    if (domain.cell.zz > 0) svg.line(view.x(view.x_low), view.y(z), view.x(view.x_high), view.y(z), faces);
  if (domain.cell.xz == 0) return;
  // Of the two edges c of the front the one that stays within the view.
  const double foot = domain.cell.xz > 0 ? low.x() : high.x();
  svg.line(view.x(foot), view.y(low.z()), view.x(foot + domain.cell.xz), view.y(high.z()),
           {style::soft_ink, 1, "5 4"});
}

double draw_scale(Svg& svg, const View& view, double y, int parts) {
  const double length = nice_ticks(0, view.x_high - view.x_low, parts).at(1), bar = length * view.scale;
  constexpr double arm = 24, head = 4, axes = 64;
  const double x = view.left, base = y + 14, right = x + arm, up = base - arm;
  svg.polyline(std::array<std::array<double, 2>, 3>{{{x, up}, {x, base}, {right, base}}}, {style::ink, 1.2});
  svg.polyline(
      std::array<std::array<double, 2>, 3>{{{x - head, up + head}, {x, up - 1}, {x + head, up + head}}},
      {style::ink, 1.2});
  svg.polyline(
      std::array<std::array<double, 2>, 3>{
          {{right - head, base - head}, {right + 1, base}, {right - head, base + head}}},
      {style::ink, 1.2});
  svg.text(right + 6, base + 4, "x", {12, style::ink});
  svg.text(x + 8, up + 4, "z", {12, style::ink});
  svg.line(x + axes, y, x + axes + bar, y, {style::ink, 3});
  svg.text(x + axes, y + 20, with_unit(length, "m"), {12, style::ink});
  return axes + bar;
}

}  // namespace talus::io::detail
