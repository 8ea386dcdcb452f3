#pragma once

/// The sample as one sees it: spheres and walls in space, rendered to an image. No graphics hardware or
/// library is asked for.

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "io/files/png.hpp"
#include "io/results/cell_outline.hpp"
#include "io/results/grain_balls.hpp"
#include "kernels/registry.hpp"
#include "kernels/shapes/walls.hpp"
#include "runtime/step/frame.hpp"

namespace talus::io {

/// What grains are coloured by.
enum class GrainColour { speed, velocity_x, velocity_y, velocity_z, radius, force, material };

/// What they are called, what they are, and in which unit ("" for none).
const Registry<GrainColour, const char*>& grain_colours();

/// Along which axis a component of the velocity points: 0, 1, 2; none of other colours. Its scale reaches as
/// far below 0 as above.
std::optional<int> velocity_axis(GrainColour colour);

/// A number for each grain of a frame. `force` is the sum of the normal forces of its contacts [N].
std::vector<double> grain_values(const Frame& frame, GrainColour colour);

/// What the ends of the scale of colours stand for.
struct ColourRange {
  double low = 0, high = 0;
};
/// From 0, or of radii the smallest, to the value that 49 of 50 do not exceed; of a component of the velocity
/// from minus to plus the magnitude that 49 of 50 do not exceed.
ColourRange colour_range(std::span<const double> values, GrainColour colour);

/// Red, green and blue, 0 to 1, of a value on the scale, or of a material by its number.
std::array<double, 3> colour_of(double value, const ColourRange& range, GrainColour colour);

/// "speed [m/s]".
std::string label_of(GrainColour colour);

/// From where one looks, without perspective.
struct Camera {
  double azimuth = -60;   ///< degrees from x towards y, of the viewer
  double elevation = 20;  ///< degrees above the plane of x and y
};

struct ViewOptions {
  Camera camera = {};
  std::size_t width = 960;  ///< [px]
  GrainColour colour = GrainColour::speed;
  std::optional<ColourRange> range = {};  ///< none: that of the frame
  std::optional<Bounds> box = {};         ///< that fills the image; none: grains and walls of the frame
  std::optional<int> slice = {};          ///< 0, 1, 2: only grains whose centres lie within two mean radii of
                                          ///< the middle of all centres along x, y, z
  GrainShapes shapes = {};                ///< of the run
};

/// The brick of the frame's periodic cell; nothing between walls.
std::vector<CellLine> lines_of_cell(const Frame& frame);

/// The box around grains, triangles and cell [m]; low > high where there is none.
Bounds view_bounds(const Frame& frame, std::span<const std::vector<Triangle>> walls);

/// Grains as shaded spheres, clumps as their balls; of the walls, `triangles` by wall (wall_triangles.hpp),
/// those behind the grains as grey faces, and the edges of those before them; and the lines of a periodic
/// cell. The image of nothing is white.
Image render_view(const Frame& frame, std::span<const Wall> walls,
                  std::span<const std::vector<Triangle>> triangles, const ViewOptions& options);

/// Edges of the triangles of a wall: where they end, or meet at more than 30 degrees.
std::vector<std::array<Vec3, 2>> edges_of(std::span<const Triangle> triangles);

/// Where a surface bends: an edge at which two triangles meet at less than that, but not in one plane. It is
/// an outline of the wall for those who see one of its triangles from the front and the other from behind.
struct Bend {
  std::array<Vec3, 2> ends;     ///< [m]
  std::array<Vec3, 2> normals;  ///< unit, of the triangles, to the same side
  bool outlines(const Vec3& viewer) const { return normals[0].dot(viewer) * normals[1].dot(viewer) < 0; }
};
std::vector<Bend> bends_of(std::span<const Triangle> triangles);

/// The view with its scale of colours, as SVG text.
std::string draw_view(const Frame& frame, std::span<const Wall> walls, const ViewOptions& options,
                      std::span<const std::string> material_names = {});

}  // namespace talus::io
