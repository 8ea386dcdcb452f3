#include "io/pictures/detail/slab.hpp"

#include <algorithm>
#include <limits>

#include "io/files/detail/with_unit.hpp"
#include "io/pictures/detail/chart_style.hpp"

namespace talus::io::detail {

Slab cut_slab(const Frame& frame, double thickness) {
  Slab slab;
  if (frame.id.empty()) return slab;
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (std::size_t k = 0; k < frame.id.size(); ++k) {
    low = std::min(low, frame.x[k].y());
    high = std::max(high, frame.x[k].y());
    slab.mean_radius += frame.radius[k];
  }
  slab.mean_radius /= static_cast<double>(frame.id.size());
  slab.middle = (low + high) / 2;
  slab.half = thickness > 0 ? thickness / 2 : 2 * slab.mean_radius;

  for (std::size_t k = 0; k < frame.id.size(); ++k) {
    if (slab.holds(frame.x[k])) slab.grains.push_back(k);
  }
  return slab;
}

View view_of(const Frame& frame, const Slab& slab, double side, double left, double top) {
  double x_low = std::numeric_limits<double>::infinity(), x_high = -x_low, z_low = x_low, z_high = -x_low;
  for (const std::size_t k : slab.grains) {
    x_low = std::min(x_low, frame.x[k].x() - frame.radius[k]);
    x_high = std::max(x_high, frame.x[k].x() + frame.radius[k]);
    z_low = std::min(z_low, frame.x[k].z() - frame.radius[k]);
    z_high = std::max(z_high, frame.x[k].z() + frame.radius[k]);
  }
  if (slab.grains.empty()) x_low = z_low = 0, x_high = z_high = 1;
  const double border = slab.grains.empty() ? 0 : slab.mean_radius;
  x_low -= border, z_low -= border, x_high += border, z_high += border;
  const double scale = side / std::max(x_high - x_low, z_high - z_low);
  return {x_low, z_low, x_high, z_high, scale, left, top};
}

double draw_scale(Svg& svg, const View& view, double y, int parts) {
  const double length = nice_ticks(0, view.x_high - view.x_low, parts).at(1), bar = length * view.scale;
  svg.line(view.left, y, view.left + bar, y, {style::ink, 3});
  svg.text(view.left, y + 20, with_unit(length, "m"), {12, style::ink});
  return bar;
}

}  // namespace talus::io::detail
