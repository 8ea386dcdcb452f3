#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include "io/files/detail/with_unit.hpp"
#include "io/pictures/detail/slab.hpp"
#include "io/pictures/detail/svg.hpp"
#include "io/pictures/picture.hpp"

namespace talus::io {
namespace {

using detail::Slab;
using detail::Svg;
using detail::View;
namespace style = detail::style;

constexpr double panel_side = 560, margin = 40, gap = 48, margin_top = 104, margin_bottom = 72;

/// White, then darker with the multiplicity; the last is for all that are higher.
constexpr std::array<std::string_view, 5> greys{"#ffffff", "#b9c2cb", "#7d8894", "#434d58", "#10151a"};

std::size_t grey_of(std::int32_t multiplicity) {
  return static_cast<std::size_t>(std::clamp<std::int32_t>(multiplicity, 1, greys.size()) - 1);
}

/// Neighbours in number are often neighbours in space: the golden angle sets their hues far apart, and three
/// lightnesses tell apart what comes round to the same hue.
std::string subdomain_colour(std::int32_t subdomain) {
  const double hue = std::fmod(subdomain * (3 - std::sqrt(5.0)) / 2, 1.0);
  const double light = 0.78 - 0.13 * (subdomain % 3), range = 0.22;
  std::array<int, 3> rgb{};
  for (std::size_t k = 0; k < 3; ++k) {
    const double phase = 2 * std::numbers::pi * (hue - static_cast<double>(k) / 3);
    rgb[k] = static_cast<int>(std::lround(255 * (light + range * std::cos(phase))));
  }
  return fmt::format("#{:02x}{:02x}{:02x}", rgb[0], rgb[1], rgb[2]);
}

template <class Colour>
void draw_grains(Svg& svg, const Frame& frame, std::span<const std::size_t> grains, const View& view,
                 Colour&& colour) {
  svg.begin_group(fmt::format(R"(stroke="{}" stroke-width="0.4")", style::soft_ink));
  for (const std::size_t k : grains) {
    svg.circle(view.x(frame.x[k].x()), view.y(frame.x[k].z()), frame.radius[k] * view.scale, colour(k));
  }
  svg.end_group();
}

}  // namespace

std::string draw_partition(const Frame& frame, std::span<const std::int32_t> subdomain,
                           std::span<const std::int32_t> multiplicity, const PartitionPicture& options) {
  if (subdomain.size() != frame.id.size() || multiplicity.size() != frame.id.size()) {
    throw std::invalid_argument(fmt::format("frame: {} subdomains and {} multiplicities for {} bodies",
                                            subdomain.size(), multiplicity.size(), frame.id.size()));
  }
  const Slab slab = detail::cut_slab(frame, options.thickness);
  const View left = detail::view_of(frame, slab, {}, {panel_side, margin, margin_top});
  View right = left;
  right.left += std::max(left.width(), 360.0) + gap;

  // The nearest to the eye on top; equal ones keep the order of the frame, for the same file each time.
  std::vector<std::size_t> order = slab.grains;
  std::ranges::stable_sort(order, std::ranges::greater{}, [&](std::size_t k) { return frame.x[k].y(); });
  std::array<std::size_t, greys.size()> count{};
  for (const std::int32_t m : multiplicity) ++count[grey_of(m)];

  const double bottom = margin_top + left.height();
  Svg svg(right.left + std::max(left.width(), 360.0) + margin, bottom + margin_bottom);
  svg.text(margin, 34, options.title, {18, style::ink, "start", true});
  svg.text(margin, 56,
           fmt::format("slab of {} about y = {}, seen along y: {} of {} grains",
                       detail::with_unit(2 * slab.half, "m"), detail::with_unit(slab.middle, "m"),
                       slab.grains.size(), frame.id.size()),
           {13, style::soft_ink});
  svg.text(margin, margin_top - 12, fmt::format("{} subdomains", options.subdomains), {13, style::ink});
  svg.text(right.left, margin_top - 12, "multiplicity", {13, style::ink});
  draw_grains(svg, frame, order, left, [&](std::size_t k) { return subdomain_colour(subdomain[k]); });
  draw_grains(svg, frame, order, right, [&](std::size_t k) { return greys[grey_of(multiplicity[k])]; });

  detail::draw_scale(svg, left, bottom + 22, 8);
  for (std::size_t k = 0; k < greys.size(); ++k) {
    const double x = right.left + 8 + 72 * static_cast<double>(k);
    svg.begin_group(fmt::format(R"(stroke="{}" stroke-width="0.7")", style::soft_ink));
    svg.circle(x, bottom + 22, 7, greys[k]);
    svg.end_group();
    svg.text(x + 12, bottom + 26, fmt::format("{}{}", k + 1, k + 1 == greys.size() ? "+" : ""));
    svg.text(x - 8, bottom + 48, fmt::format("{}", count[k]), {11, style::soft_ink});
  }
  return svg.finish();
}

}  // namespace talus::io
