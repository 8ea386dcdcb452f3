#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "io/pictures/detail/svg.hpp"
#include "runtime/step/frame.hpp"

namespace talus::io::detail {

/// Grains whose centre lies in a slab about the middle of the sample, normal to y.
struct Slab {
  double middle = 0, half = 0;      ///< |y - middle| <= half [m]
  double mean_radius = 0;           ///< of all grains of the frame [m]
  std::vector<std::size_t> grains;  ///< places in the frame, ascending

  bool holds(const Vec3& centre) const { return std::abs(centre.y() - middle) <= half; }
};

/// `thickness` [m]; 0: four mean radii. Without grains an empty slab.
Slab cut_slab(const Frame& frame, double thickness);

/// From metres in the plane of x and z to pixels.
struct View {
  double x_low, z_low, x_high, z_high;  ///< [m]
  double scale;                         ///< [px/m]
  double left, top;                     ///< [px]
  double x(double metres) const { return left + (metres - x_low) * scale; }
  double y(double metres) const { return top + (z_high - metres) * scale; }
  double width() const { return (x_high - x_low) * scale; }
  double height() const { return (z_high - z_low) * scale; }
};

/// The grains of the slab and a border of a mean radius, with `side` [px] for the longer edge.
View view_of(const Frame& frame, const Slab& slab, double side, double left, double top);

/// Draws a bar of a round length, about 1/`parts` of the view's width, at its left edge and the height y
/// [px], with the length below. Returns the length of the bar [px].
double draw_scale(Svg& svg, const View& view, double y, int parts);

}  // namespace talus::io::detail
