#include "io/pictures/view.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <tuple>

#include "io/pictures/detail/slab.hpp"
#include "io/results/wall_triangles.hpp"

namespace talus::io {
namespace {

using Colour = std::array<double, 3>;
using Tint = std::array<std::uint8_t, 3>;  ///< of a sample: there are millions

/// The nearest whole number; std::lround is a call for each of millions of samples.
std::uint8_t nearest(double tone) {
  return static_cast<std::uint8_t>(tone + 0.5);
}
std::uint8_t tone(double part) {
  return nearest(255 * std::clamp(part, 0.0, 1.0));
}

constexpr std::size_t samples = 2;  // per pixel and direction
constexpr Colour edge_colour{0.35, 0.4, 0.45};
constexpr double infinity = std::numeric_limits<double>::infinity();

/// Directions of the image in space: to the right, up, and towards the viewer.
struct Axes {
  Vec3 right, up, viewer;
};

Axes axes_of(const Camera& camera) {
  const double a = camera.azimuth * std::numbers::pi / 180, e = camera.elevation * std::numbers::pi / 180;
  const Vec3 viewer(std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e));
  const Vec3 right(-std::sin(a), std::cos(a), 0);
  return {right, viewer.cross(right), viewer};
}

/// From space to samples of the image.
struct Projection {
  Axes axes;
  double scale = 1;     ///< samples a metre
  double x = 0, y = 0;  ///< of the image's middle along right and up [m]
  double width = 0, height = 0;
  Vec3 of(const Vec3& p) const {
    return {width / 2 + (p.dot(axes.right) - x) * scale, height / 2 - (p.dot(axes.up) - y) * scale,
            p.dot(axes.viewer) * scale};
  }
};

Projection fitted(const Bounds& box, const Axes& axes, std::size_t width) {
  constexpr double margin = 0.04, tallest = 1.0;
  double low[2] = {infinity, infinity}, high[2] = {-infinity, -infinity};
  for (int corner = 0; corner < 8; ++corner) {
    Vec3 p;
    for (int k = 0; k < 3; ++k) p[k] = (corner >> k & 1) != 0 ? box.high[k] : box.low[k];
    const double at[2] = {p.dot(axes.right), p.dot(axes.up)};
    for (int k = 0; k < 2; ++k) low[k] = std::min(low[k], at[k]), high[k] = std::max(high[k], at[k]);
  }
  const double across = high[0] - low[0], along = high[1] - low[1];
  Projection view{axes};
  view.width = static_cast<double>(width * samples);
  view.height = std::max(1.0, std::ceil(view.width / samples * std::min(tallest, along / across))) * samples;
  view.scale = (1 - 2 * margin) * std::min(view.width / across, view.height / along);
  view.x = (low[0] + high[0]) / 2, view.y = (low[1] + high[1]) / 2;
  return view;
}

/// Colours and depths of samples; larger depths are nearer.
class Canvas {
 public:
  explicit Canvas(const Projection& view)
      : width_(static_cast<std::size_t>(view.width)),
        height_(static_cast<std::size_t>(view.height)),
        colour_(width_ * height_, Tint{255, 255, 255}),
        depth_(width_ * height_, empty) {}

  std::size_t width() const { return width_; }
  std::size_t height() const { return height_; }

  void sphere(const Vec3& at, double radius, const Colour& colour) {
    static const Vec3 light = Vec3(-0.42, 0.55, 0.72).normalized();
    const double nearest = at.z() + radius;
    each(at.x() - radius, at.x() + radius, at.y() - radius, at.y() + radius,
         [&](std::size_t x, std::size_t y) {
           if (hidden(x, y, nearest)) return;  // most samples are: grains lie behind one another
           const double dx = (centre(x) - at.x()) / radius, dy = (at.y() - centre(y)) / radius;
           const double rest = 1 - dx * dx - dy * dy;
           if (rest < 0) return;
           const Vec3 normal(dx, dy, std::sqrt(rest));
           const double depth = at.z() + radius * normal.z();
           if (hidden(x, y, depth)) return;
           const double bright = std::max(0.0, normal.dot(light));
           const double rim = std::min(1.0, 0.55 + normal.z());  // the edge of a grain is darker
           const double mirror = std::max(0.0, 2 * bright * normal.z() - light.z()),
                        third = mirror * mirror * mirror;
           const double twelfth = third * third * third * third, shine = 0.18 * twelfth * twelfth;
           put(x, y, depth, shaded(colour, (0.42 + 0.6 * bright) * rim, shine));
         });
  }

  void triangle(const std::array<Vec3, 3>& p, const Colour& colour) {
    const auto [low_x, high_x] = std::minmax({p[0].x(), p[1].x(), p[2].x()});
    const auto [low_y, high_y] = std::minmax({p[0].y(), p[1].y(), p[2].y()});
    const double area = cross(p[0], p[1], p[2].x(), p[2].y());
    if (area == 0) return;
    each(low_x, high_x, low_y, high_y, [&](std::size_t x, std::size_t y) {
      const double a = cross(p[1], p[2], centre(x), centre(y)) / area,
                   b = cross(p[2], p[0], centre(x), centre(y)) / area, c = 1 - a - b;
      if (a < 0 || b < 0 || c < 0) return;
      put(x, y, a * p[0].z() + b * p[1].z() + c * p[2].z(), colour);
    });
  }

  /// As wide as a pixel; what lies before it hides it.
  void line(const Vec3& from, const Vec3& to, const Colour& colour) {
    const double length = std::max(std::abs(to.x() - from.x()), std::abs(to.y() - from.y()));
    const auto steps = static_cast<std::size_t>(std::ceil(length)) + 1;
    for (std::size_t k = 0; k <= steps; ++k) {
      const Vec3 at = from + static_cast<double>(k) / static_cast<double>(steps) * (to - from);
      const double half = samples / 2.0;
      each(at.x() - half, at.x() + half, at.y() - half, at.y() + half,
           [&](std::size_t x, std::size_t y) { put(x, y, at.z() + 1, colour); });
    }
  }

  /// Darkens grains that lie deeper than those around them within `reach` samples (after Luft, Colditz and
  /// Deussen 2006): gaps look deep. What is drawn later is left as it is. The depth around is that of pixels.
  void darken_gaps(double reach) {
    const std::size_t width = width_ / samples, height = height_ / samples;
    // Calls visit(sample, pixel) for the samples that something covers.
    const auto each_covered = [&](const auto& visit) {
      for (std::size_t y = 0, k = 0; y < height_; ++y)
        for (std::size_t x = 0; x < width_; ++x, ++k)
          if (depth_[k] > empty) visit(k, y / samples * width + x / samples);
    };
    std::vector<float> around(width * height, 0.0F), weight(width * height, 0.0F);
    each_covered([&](std::size_t k, std::size_t pixel) { around[pixel] += depth_[k], weight[pixel] += 1; });
    const auto radius = static_cast<std::size_t>(std::clamp(reach / samples, 1.0, 30.0));
    for (int pass = 0; pass < 2; ++pass)
      for (std::vector<float>* of : {&around, &weight}) {
        blur(*of, width, height, 1, width, radius);
        blur(*of, height, width, width, 1, radius);
      }
    each_covered([&](std::size_t k, std::size_t pixel) {
      const double mean = double{around[pixel]} / weight[pixel];
      const double deep = std::clamp((mean - depth_[k]) / (2 * reach), 0.0, 1.0);
      for (std::uint8_t& c : colour_[k]) c = nearest(c * (1 - 0.6 * deep));
    });
  }

  Image image() const {
    Image out{width_ / samples, height_ / samples, {}};
    out.rgb.reserve(3 * out.width * out.height);
    for (std::size_t y = 0; y < out.height; ++y)
      for (std::size_t x = 0; x < out.width; ++x)
        for (std::size_t c = 0; c < 3; ++c) {
          std::size_t sum = 0;
          for (std::size_t v = 0; v < samples; ++v)
            for (std::size_t u = 0; u < samples; ++u)
              sum += colour_[(y * samples + v) * width_ + x * samples + u][c];
          out.rgb.push_back(static_cast<std::uint8_t>((sum + samples * samples / 2) / (samples * samples)));
        }
    return out;
  }

 private:
  static double centre(std::size_t k) { return static_cast<double>(k) + 0.5; }
  static double cross(const Vec3& a, const Vec3& b, double x, double y) {
    return (b.x() - a.x()) * (y - a.y()) - (b.y() - a.y()) * (x - a.x());
  }
  static Colour shaded(const Colour& colour, double bright, double shine) {
    return {colour[0] * bright + shine, colour[1] * bright + shine, colour[2] * bright + shine};
  }
  template <class Visit>
  void each(double low_x, double high_x, double low_y, double high_y, const Visit& visit) {
    const auto end = [](double low, double high, std::size_t size) {
      const double most = static_cast<double>(size);
      return std::pair{static_cast<std::size_t>(std::clamp(std::floor(low), 0.0, most)),
                       static_cast<std::size_t>(std::clamp(std::ceil(high), 0.0, most))};
    };
    const auto [x0, x1] = end(low_x, high_x, width_);
    const auto [y0, y1] = end(low_y, high_y, height_);
    for (std::size_t y = y0; y < y1; ++y)
      for (std::size_t x = x0; x < x1; ++x) visit(x, y);
  }
  bool hidden(std::size_t x, std::size_t y, double depth) const {
    return static_cast<float>(depth) <= depth_[y * width_ + x];
  }
  void put(std::size_t x, std::size_t y, double depth, const Colour& colour) {
    if (hidden(x, y, depth)) return;
    const std::size_t k = y * width_ + x;
    depth_[k] = static_cast<float>(depth);
    for (std::size_t c = 0; c < 3; ++c) colour_[k][c] = tone(colour[c]);
  }
  /// Mean over 2 radius + 1 neighbours along lines of `length` values, `step` apart; `lines` of them.
  static void blur(std::vector<float>& values, std::size_t length, std::size_t lines, std::size_t step,
                   std::size_t next, std::size_t radius) {
    std::vector<double> sum(length + 1);
    for (std::size_t line = 0; line < lines; ++line) {
      float* first = values.data() + line * next;
      for (std::size_t k = 0; k < length; ++k) sum[k + 1] = sum[k] + double{first[k * step]};
      for (std::size_t k = 0; k < length; ++k) {
        const std::size_t from = k < radius ? 0 : k - radius, to = std::min(length, k + radius + 1);
        first[k * step] = static_cast<float>((sum[to] - sum[from]) / static_cast<double>(to - from));
      }
    }
  }

  std::size_t width_, height_;
  static constexpr float empty = -std::numeric_limits<float>::infinity();
  std::vector<Tint> colour_;
  std::vector<float> depth_;
};

struct ByEnds {
  bool operator()(const std::array<Vec3, 2>& a, const std::array<Vec3, 2>& b) const {
    const auto numbers = [](const std::array<Vec3, 2>& e) {
      return std::tuple(e[0].x(), e[0].y(), e[0].z(), e[1].x(), e[1].y(), e[1].z());
    };
    return numbers(a) < numbers(b);
  }
};
/// Unit normals of the triangles at each edge, whose ends stand in a fixed order.
std::map<std::array<Vec3, 2>, std::vector<Vec3>, ByEnds> edges_with_normals(
    std::span<const Triangle> triangles) {
  std::map<std::array<Vec3, 2>, std::vector<Vec3>, ByEnds> edges;
  for (const Triangle& t : triangles) {
    const Vec3 normal = (t[1] - t[0]).cross(t[2] - t[0]).normalized();
    for (std::size_t k = 0; k < 3; ++k) {
      std::array<Vec3, 2> ends{t[k], t[(k + 1) % 3]};
      if (ByEnds()({ends[1], ends[0]}, ends)) std::swap(ends[0], ends[1]);
      edges[ends].push_back(normal);
    }
  }
  return edges;
}
bool is_smooth(const std::vector<Vec3>& normals) {
  static const double flat = std::cos(std::numbers::pi / 6);
  return normals.size() == 2 && std::abs(normals[0].dot(normals[1])) >= flat;
}

Vec3 centre_of(const Triangle& t) {
  return (t[0] + t[1] + t[2]) / 3;
}

/// Whether a part of a wall about `part` stands between the viewer and the grains about `middle`. Solids
/// among the grains hide what is behind them like grains do.
bool stands_before(const Wall& wall, const Vec3& part, const Vec3& middle, const Vec3& viewer) {
  if (wall.surface() != nullptr && !wall.shape.values.truth("inside")) return false;
  return (part - middle).dot(viewer) > 0;
}

void draw_wall(Canvas& canvas, const Projection& view, const Wall& wall, const Vec3& grains,
               std::span<const Triangle> triangles) {
  if (triangles.empty()) return;
  Vec3 middle = Vec3::Zero();
  for (const Triangle& triangle : triangles)
    middle += centre_of(triangle) / static_cast<double>(triangles.size());
  for (const Triangle& triangle : triangles) {
    const bool before = wall.surface() == nullptr
                            ? stands_before(wall, middle, grains, view.axes.viewer)
                            : stands_before(wall, centre_of(triangle), middle, view.axes.viewer);
    if (before) continue;
    const Vec3 normal = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]).normalized();
    const double bright = 0.84 + 0.12 * std::abs(normal.dot(Vec3(0.3, 0.2, 0.93)));
    canvas.triangle({view.of(triangle[0]), view.of(triangle[1]), view.of(triangle[2])},
                    {bright, bright, std::min(1.0, bright + 0.015)});
  }
  for (const auto& [a, b] : edges_of(triangles)) canvas.line(view.of(a), view.of(b), edge_colour);
  for (const Bend& bend : bends_of(triangles))
    if (bend.outlines(view.axes.viewer))
      canvas.line(view.of(bend.ends[0]), view.of(bend.ends[1]), edge_colour);
}

/// The balls of the slice that is asked for, or all.
std::vector<SeenBall> shown_balls(const Frame& frame, const ViewOptions& options) {
  std::vector<SeenBall> balls = seen_balls(frame, options.shapes);
  if (!options.slice || frame.x.empty()) return balls;
  const auto place = [&](const Vec3& x) { return x[*options.slice]; };
  double low = infinity, high = -infinity;
  for (const Vec3& x : frame.x) low = std::min(low, place(x)), high = std::max(high, place(x));
  const double radii = std::accumulate(frame.radius.begin(), frame.radius.end(), 0.0),
               half = detail::half_of_slab(0, radii / static_cast<double>(frame.radius.size()));
  std::erase_if(balls, [&](const SeenBall& ball) {
    return std::abs(place(frame.x[ball.grain]) - (low + high) / 2) > half;
  });
  return balls;
}

/// Balls in the order in which they hide one another: behind those that are drawn there is nothing to do.
std::vector<std::size_t> nearest_first(std::span<const SeenBall> balls, const Vec3& viewer) {
  std::vector<std::size_t> order(balls.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::vector<double> depth(order.size());
  for (const std::size_t k : order) depth[k] = balls[k].centre.dot(viewer);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return depth[a] > depth[b]; });
  return order;
}

}  // namespace

std::vector<CellLine> lines_of_cell(const Frame& frame) {
  const std::optional<CellBox> cell = cell_box(frame.domain, grain_bounds(frame));
  if (!cell) return {};
  std::vector<CellLine> lines = cell_lines(*cell);
  std::erase_if(lines, [](const CellLine& line) { return line.edge != 0; });
  return lines;
}

Bounds view_bounds(const Frame& frame, std::span<const std::vector<Triangle>> walls) {
  Bounds box{Vec3::Constant(infinity), Vec3::Constant(-infinity)};
  const auto widen = [&](const Vec3& p, double r) {
    box.low = box.low.cwiseMin(p - Vec3::Constant(r)), box.high = box.high.cwiseMax(p + Vec3::Constant(r));
  };
  for (std::size_t k = 0; k < frame.id.size(); ++k) widen(frame.x[k], frame.radius[k]);
  for (const std::vector<Triangle>& wall : walls)
    for (const Triangle& triangle : wall)
      for (const Vec3& corner : triangle) widen(corner, 0);
  for (const CellLine& line : lines_of_cell(frame))
    for (const Vec3& end : line.ends) widen(end, 0);
  return box;
}

std::vector<std::array<Vec3, 2>> edges_of(std::span<const Triangle> triangles) {
  std::vector<std::array<Vec3, 2>> sharp;
  for (const auto& [ends, normals] : edges_with_normals(triangles))
    if (!is_smooth(normals)) sharp.push_back(ends);
  return sharp;
}

std::vector<Bend> bends_of(std::span<const Triangle> triangles) {
  constexpr double plane = 1 - 1e-9;
  std::vector<Bend> bends;
  for (const auto& [ends, normals] : edges_with_normals(triangles)) {
    if (!is_smooth(normals)) continue;
    const double along = normals[0].dot(normals[1]);
    if (std::abs(along) < plane) bends.push_back({ends, {normals[0], along < 0 ? -normals[1] : normals[1]}});
  }
  return bends;
}

Image render_view(const Frame& frame, std::span<const Wall> walls,
                  std::span<const std::vector<Triangle>> triangles, const ViewOptions& options) {
  const Bounds box = options.box.value_or(view_bounds(frame, triangles));
  constexpr double largest = 1e100;  // [m] whose squares and ratios are numbers
  const double size = (box.high - box.low).cwiseAbs().maxCoeff();
  if (!(box.high.array() >= box.low.array()).all() || size == 0 || size > largest) {
    const std::size_t height = options.width / 2;
    return {options.width, height, std::vector<std::uint8_t>(3 * options.width * height, 255)};
  }
  const Projection view = fitted(box, axes_of(options.camera), options.width);
  Canvas canvas(view);
  const std::vector<double> values = grain_values(frame, options.colour);
  const ColourRange range = options.range.value_or(colour_range(values, options.colour));
  const std::vector<SeenBall> balls = shown_balls(frame, options);
  double radii = 0;
  for (const std::size_t k : nearest_first(balls, view.axes.viewer)) {
    const auto& [centre, radius, grain] = balls[k];
    radii += radius;
    canvas.sphere(view.of(centre), radius * view.scale, colour_of(values[grain], range, options.colour));
  }
  if (!balls.empty()) canvas.darken_gaps(1.5 * radii / static_cast<double>(balls.size()) * view.scale);
  const Vec3 middle = (box.low + box.high) / 2;
  for (std::size_t w = 0; w < std::min(walls.size(), triangles.size()); ++w)
    draw_wall(canvas, view, walls[w], middle, triangles[w]);
  for (const CellLine& line : lines_of_cell(frame))
    canvas.line(view.of(line.ends[0]), view.of(line.ends[1]), edge_colour);
  return canvas.image();
}

}  // namespace talus::io
