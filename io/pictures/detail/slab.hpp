#pragma once

#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "io/pictures/detail/svg.hpp"
#include "io/pictures/picture.hpp"
#include "kernels/shapes/walls.hpp"
#include "runtime/step/frame.hpp"

namespace talus::io::detail {

/// Grains whose centre lies in a slab about the middle of the sample, normal to y.
struct Slab {
  double middle = 0, half = 0;      ///< |y - middle| <= half [m]
  SampleExtent sample;              ///< all grains
  std::vector<std::size_t> grains;  ///< places in the frame, ascending

  bool holds(const Vec3& centre) const { return std::abs(centre.y() - middle) <= half; }
};

/// Half of a slab's thickness [m]; 0: that of four mean radii.
inline double half_of_slab(double thickness, double mean_radius) {
  return thickness > 0 ? thickness / 2 : 2 * mean_radius;
}

/// `thickness` [m]; 0: four mean radii. Without grains an empty slab. `sample`: as in ForcePicture.
Slab cut_slab(const Frame& frame, double thickness, const std::optional<SampleExtent>& sample = {});
/// The same without grains.
Slab empty_slab(const SampleExtent& sample, double thickness);

/// A straight line in the plane of x and z [m].
struct Cut {
  double x1, z1, x2, z2;
};

/// Where walls cut the plane in the middle of the slab. `walls` are those of frame.walls, in that order;
/// those beyond either list are not there.
std::vector<Cut> cut_walls(const Frame& frame, std::span<const Wall> walls, const Slab& slab);

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

/// Where a view stands on its page [px].
struct Placement {
  double side;  ///< of the longer edge
  double left, top;
};

/// The grains of the slab, the walls and the periodic cell about them, and a border of a mean radius. Walls
/// are cut off that go on beyond half the longer side of the grains.
View view_of(const Frame& frame, const Slab& slab, std::span<const Cut> walls, const Placement& at);

/// Walls within the view.
void draw_walls(Svg& svg, const View& view, std::span<const Cut> walls);

/// The faces of a periodic cell along x and z; where they lean, c as a dashed line from a lower corner.
void draw_cell(Svg& svg, const View& view, const Domain& domain);

/// Draws at the left edge of the view and the height y [px] both axes with their names, and a bar of a round
/// length, about 1/`parts` of the view's width, with the length below. Returns the width of both [px].
double draw_scale(Svg& svg, const View& view, double y, int parts);

}  // namespace talus::io::detail
