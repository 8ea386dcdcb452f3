#pragma once

/// The sample as one sees it: spheres and walls in space, rendered to an image. No graphics hardware or
/// library is asked for.

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "io/files/png.hpp"
#include "io/pictures/grain_balls.hpp"
#include "io/results/cell_outline.hpp"
#include "kernels/registry.hpp"
#include "kernels/shapes/walls.hpp"
#include "runtime/step/frame.hpp"

namespace talus::io {

/// What grains are coloured by.
enum class GrainColour { speed, radius, force, material };

/// What they are called, what they are, and in which unit ("" for none).
const Registry<GrainColour, const char*>& grain_colours();

/// A number for each grain of a frame. `force` is the sum of the normal forces of its contacts [N].
std::vector<double> grain_values(const Frame& frame, GrainColour colour);

/// What the ends of the scale of colours stand for.
struct ColourRange {
  double low = 0, high = 0;
};
/// From 0, or of radii the smallest, to the value that 49 of 50 do not exceed.
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

/// The view with its scale of colours, as SVG text.
std::string draw_view(const Frame& frame, std::span<const Wall> walls, const ViewOptions& options,
                      std::span<const std::string> material_names = {});

}  // namespace talus::io
