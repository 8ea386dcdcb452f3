/// What grains of a view are coloured by, and the view with its scale.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "io/files/detail/with_unit.hpp"
#include "io/pictures/detail/chart_style.hpp"
#include "io/pictures/detail/svg.hpp"
#include "io/pictures/view.hpp"
#include "io/results/detail/base64.hpp"
#include "io/results/detail/body_index.hpp"
#include "io/results/wall_triangles.hpp"

namespace talus::io {
namespace {

using Colour = std::array<double, 3>;

/// Dark to light, as even in lightness as the eye sees it (the corner stones of viridis, matplotlib).
constexpr Colour stones[] = {{0.267, 0.005, 0.329}, {0.283, 0.141, 0.458}, {0.254, 0.265, 0.530},
                             {0.207, 0.372, 0.553}, {0.164, 0.471, 0.558}, {0.128, 0.567, 0.551},
                             {0.135, 0.659, 0.518}, {0.267, 0.749, 0.441}, {0.478, 0.821, 0.318},
                             {0.741, 0.873, 0.150}, {0.993, 0.906, 0.144}};

/// From what moves one way to what moves the other; light in the middle (after RdBu of ColorBrewer, Brewer
/// 2002).
constexpr Colour ways[] = {{0.02, 0.19, 0.38}, {0.13, 0.40, 0.67}, {0.26, 0.58, 0.76}, {0.57, 0.77, 0.87},
                           {0.82, 0.90, 0.94}, {0.97, 0.97, 0.97}, {0.99, 0.86, 0.78}, {0.96, 0.65, 0.51},
                           {0.84, 0.38, 0.30}, {0.70, 0.09, 0.17}, {0.40, 0.00, 0.12}};

Colour parsed(std::string_view hue) {
  const auto part = [&](std::size_t at) {
    return std::stoi(std::string(hue.substr(at, 2)), nullptr, 16) / 255.0;
  };
  return {part(1), part(3), part(5)};
}

std::string hex(const Colour& c) {
  return fmt::format("#{:02x}{:02x}{:02x}", std::lround(255 * c[0]), std::lround(255 * c[1]),
                     std::lround(255 * c[2]));
}

void draw_legend(detail::Svg& svg, const ViewOptions& options, const ColourRange& range, double y) {
  constexpr double left = 40, width = 240, steps = 60;
  for (double k = 0; k < steps; ++k)
    svg.rectangle(
        left + k * width / steps, y, width / steps + 0.3, 12,
        hex(colour_of(range.low + (k + 0.5) / steps * (range.high - range.low), range, options.colour)));
  svg.text(left, y + 28,
           range.low == 0 ? "0"
                          : detail::with_unit(range.low, grain_colours().of(options.colour).make) +
                                (velocity_axis(options.colour) ? " and less" : ""));
  svg.text(left + width, y + 28,
           detail::with_unit(range.high, grain_colours().of(options.colour).make) +
               (options.colour == GrainColour::radius ? "" : " and more"),
           {12, detail::style::ink, "middle"});
  svg.text(left + width + 24, y + 10, std::string(grain_colours().of(options.colour).sentence),
           {12, detail::style::soft_ink});
}

void draw_materials(detail::Svg& svg, std::span<const std::string> names, double y) {
  double x = 46;
  for (std::size_t m = 0; m < names.size(); ++m) {
    svg.circle(x, y + 6, 6, detail::hue(m));
    svg.text(x + 12, y + 10, names[m]);
    x += 36 + detail::text_width(names[m], 12);
  }
}

}  // namespace

const Registry<GrainColour, const char*>& grain_colours() {
  static constexpr Entry<GrainColour, const char*> entries[] = {
      {GrainColour::speed, "speed", "speed", "m/s"},
      {GrainColour::velocity_x, "velocity_x", "velocity along x", "m/s"},
      {GrainColour::velocity_y, "velocity_y", "velocity along y", "m/s"},
      {GrainColour::velocity_z, "velocity_z", "velocity along z", "m/s"},
      {GrainColour::radius, "radius", "radius", "m"},
      {GrainColour::force, "force", "sum of normal forces", "N"},
      {GrainColour::material, "material", "material", ""}};
  static constexpr Registry<GrainColour, const char*> registry("way to colour grains", entries);
  return registry;
}

std::string label_of(GrainColour colour) {
  const auto& [kind, name, sentence, unit] = grain_colours().of(colour);
  return *unit == '\0' ? std::string(sentence) : fmt::format("{} [{}]", sentence, unit);
}

std::optional<int> velocity_axis(GrainColour colour) {
  if (colour < GrainColour::velocity_x || colour > GrainColour::velocity_z) return std::nullopt;
  return static_cast<int>(colour) - static_cast<int>(GrainColour::velocity_x);
}

std::vector<double> grain_values(const Frame& frame, GrainColour colour) {
  std::vector<double> values(frame.id.size(), 0.0);
  switch (colour) {
    case GrainColour::speed:
      for (std::size_t k = 0; k < frame.u.size(); ++k) values[k] = frame.u[k].norm();
      break;
    case GrainColour::velocity_x:
    case GrainColour::velocity_y:
    case GrainColour::velocity_z:
      for (std::size_t k = 0; k < frame.u.size(); ++k) values[k] = frame.u[k][*velocity_axis(colour)];
      break;
    case GrainColour::radius:
      values = frame.radius;
      break;
    case GrainColour::material:
      for (std::size_t k = 0; k < frame.material.size(); ++k)
        values[k] = static_cast<double>(frame.material[k]);
      break;
    case GrainColour::force: {
      const detail::BodyIndex index(frame.id);
      for (std::size_t k = 0; k < frame.contact_bodies.size(); ++k) {
        const double normal = frame.contact_force[k].dot(frame.contact_normal[k]);
        for (const std::int64_t body : frame.contact_bodies[k])
          if (body >= 0) values[index.at(body)] += normal;
      }
    }
  }
  return values;
}

ColourRange colour_range(std::span<const double> values, GrainColour colour) {
  if (values.empty()) return {0, 1};
  const bool two_ways = velocity_axis(colour).has_value();
  std::vector<double> sorted(values.begin(), values.end());
  if (two_ways)
    for (double& value : sorted) value = std::abs(value);
  std::ranges::sort(sorted);
  const double most = sorted[(sorted.size() - 1) * 49 / 50];
  const double usual = most > 0 ? most : sorted.back();  // a few that move among grains at rest
  if (two_ways) return usual > 0 ? ColourRange{-usual, usual} : ColourRange{-1, 1};
  const ColourRange range =
      colour == GrainColour::radius ? ColourRange{sorted.front(), sorted.back()} : ColourRange{0, usual};
  return range.high > range.low ? range : ColourRange{range.low, range.low > 0 ? 2 * range.low : 1};
}

Colour colour_of(double value, const ColourRange& range, GrainColour colour) {
  if (colour == GrainColour::material)
    return parsed(detail::hue(static_cast<std::size_t>(std::max(value, 0.0))));
  static_assert(std::size(ways) == std::size(stones));
  const auto& scale = velocity_axis(colour) ? ways : stones;
  constexpr std::size_t last = std::size(stones) - 1;
  const double at = std::clamp((value - range.low) / (range.high - range.low), 0.0, 1.0) * last;
  const std::size_t below = std::min(static_cast<std::size_t>(at), last - 1);
  const double part = at - static_cast<double>(below);
  Colour mixed{};
  for (std::size_t c = 0; c < 3; ++c) mixed[c] = (1 - part) * scale[below][c] + part * scale[below + 1][c];
  return mixed;
}

std::string draw_view(const Frame& frame, std::span<const Wall> walls, const ViewOptions& options,
                      std::span<const std::string> material_names) {
  const auto triangles = wall_triangles(walls, frame.walls, grain_bounds(frame));
  const Image image = render_view(frame, walls, triangles, options);
  const std::string bytes = png_bytes(image), data = detail::base64_of(std::as_bytes(std::span(bytes)));
  const double width = static_cast<double>(image.width), height = static_cast<double>(image.height);
  constexpr double head = 64, foot = 56;
  detail::Svg svg(width, head + height + foot);
  svg.text(40, 34,
           fmt::format("The sample, stage \u201c{}\u201d, t = {}", frame.stage,
                       detail::with_unit(frame.time, "s")),
           {18, detail::style::ink, "start", true});
  constexpr std::array<char, 3> axes{'x', 'y', 'z'};
  const std::string cut = options.slice ? fmt::format(", those in a slice across {} shown",
                                                      axes[static_cast<std::size_t>(*options.slice)])
                                        : "";
  svg.text(40, 54,
           fmt::format("{} grains{}, coloured by {}", frame.id.size(), cut,
                       grain_colours().of(options.colour).sentence),
           {13, detail::style::soft_ink});
  svg.image(0, head, width, height, "data:image/png;base64," + data);
  if (options.colour == GrainColour::material)
    draw_materials(svg, material_names, head + height + 12);
  else
    draw_legend(svg, options,
                options.range.value_or(colour_range(grain_values(frame, options.colour), options.colour)),
                head + height + 12);
  return svg.finish();
}

}  // namespace talus::io
