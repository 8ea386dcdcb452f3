#include "io/pictures/detail/svg.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <utility>

namespace talus::io::detail {
std::string escaped(std::string_view content) {
  std::string result;
  for (const char c : content) {
    switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      default:
        result += c;
    }
  }
  return result;
}

namespace {

std::string attributes(const Stroke& stroke) {
  std::string text = fmt::format(R"(stroke="{}" stroke-width="{:.2f}")", stroke.colour, stroke.width);
  if (!stroke.dashes.empty()) text += fmt::format(R"( stroke-dasharray="{}")", stroke.dashes);
  return text;
}

}  // namespace

Svg::Svg(double width, double height) {
  text_ = fmt::format(
      R"(<?xml version="1.0" encoding="UTF-8"?>
<svg xmlns="http://www.w3.org/2000/svg" width="{0:.0f}" height="{1:.0f}" viewBox="0 0 {0:.0f} {1:.0f}" )"
      R"(font-family="Helvetica, Arial, 'Liberation Sans', 'DejaVu Sans', sans-serif">
)",
      width, height);
  rectangle(0, 0, width, height, "#ffffff");
}

void Svg::line(double x1, double y1, double x2, double y2, const Stroke& stroke) {
  fmt::format_to(std::back_inserter(text_),
                 "<line x1=\"{:.2f}\" y1=\"{:.2f}\" x2=\"{:.2f}\" y2=\"{:.2f}\" {}/>\n", x1, y1, x2, y2,
                 attributes(stroke));
}

void Svg::polyline(std::span<const std::array<double, 2>> points, const Stroke& stroke) {
  text_ += "<polyline fill=\"none\" stroke-linejoin=\"round\" points=\"";
  for (const auto& [x, y] : points) fmt::format_to(std::back_inserter(text_), "{:.2f},{:.2f} ", x, y);
  fmt::format_to(std::back_inserter(text_), "\" {}/>\n", attributes(stroke));
}

void Svg::rectangle(double x, double y, double width, double height, std::string_view fill) {
  fmt::format_to(std::back_inserter(text_),
                 "<rect x=\"{:.2f}\" y=\"{:.2f}\" width=\"{:.2f}\" height=\"{:.2f}\" fill=\"{}\"/>\n", x, y,
                 width, height, fill);
}

void Svg::circle(double x, double y, double radius, std::string_view fill) {
  fmt::format_to(std::back_inserter(text_),
                 "<circle cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"{:.2f}\" fill=\"{}\"/>\n", x, y, radius, fill);
}

void Svg::text(double x, double y, std::string_view content, const Letters& letters) {
  fmt::format_to(std::back_inserter(text_),
                 "<text x=\"{:.2f}\" y=\"{:.2f}\" font-size=\"{:.1f}\" fill=\"{}\" text-anchor=\"{}\"", x, y,
                 letters.size, letters.colour, letters.anchor);
  if (letters.bold) text_ += " font-weight=\"bold\"";
  if (letters.turn != 0) {
    fmt::format_to(std::back_inserter(text_), " transform=\"rotate({:.0f} {:.2f} {:.2f})\"", letters.turn, x,
                   y);
  }
  fmt::format_to(std::back_inserter(text_), ">{}</text>\n", escaped(content));
}

void Svg::image(double x, double y, double width, double height, std::string_view reference) {
  fmt::format_to(std::back_inserter(text_),
                 "<image x=\"{:.2f}\" y=\"{:.2f}\" width=\"{:.2f}\" height=\"{:.2f}\" href=\"{}\"/>\n", x, y,
                 width, height, reference);
}

void Svg::begin_group(std::string_view attributes_of_all) {
  fmt::format_to(std::back_inserter(text_), "<g {}>\n", attributes_of_all);
}

void Svg::end_group() {
  text_ += "</g>\n";
}

std::string Svg::finish() {
  return std::move(text_ += "</svg>\n");
}

double text_width(std::string_view text, double size) {
  constexpr double mean_letter = 0.55;  // over the size
  const auto letters = std::ranges::count_if(text, [](char c) { return (c & 0xc0) != 0x80; });  // of UTF-8
  return mean_letter * size * static_cast<double>(letters);
}

std::vector<double> nice_ticks(double low, double high, int wanted) {
  const double raw = (high - low) / std::max(1, wanted);
  const double decade = std::pow(10, std::floor(std::log10(raw)));
  const double scaled = raw / decade;
  const double step = decade * (scaled <= 1 ? 1 : scaled <= 2 ? 2 : scaled <= 5 ? 5 : 10);
  const auto first = static_cast<std::int64_t>(std::floor(low / step + 1e-9));
  const auto last = static_cast<std::int64_t>(std::ceil(high / step - 1e-9));
  std::vector<double> ticks;
  for (std::int64_t k = first; k <= last; ++k) ticks.push_back(static_cast<double>(k) * step);
  return ticks;
}

}  // namespace talus::io::detail
