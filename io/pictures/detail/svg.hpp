#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace talus::io::detail {

/// Colours and letters of every picture.
namespace style {
inline constexpr std::string_view ink = "#1f2933";
inline constexpr std::string_view soft_ink = "#66727f";
inline constexpr std::string_view grid = "#e4e8ec";
inline constexpr std::string_view blue = "#1d5fa8";
inline constexpr std::string_view orange = "#c8511b";
inline constexpr std::string_view grain_fill = "#f1f4f7";
inline constexpr std::string_view grain_edge = "#a9b4bf";
}  // namespace style

/// The text with the characters that mean something to XML and HTML replaced.
std::string escaped(std::string_view content);

struct Stroke {
  std::string_view colour = style::ink;
  double width = 1;
  std::string_view dashes = "";  ///< as in SVG, "" for a full line
};

struct Letters {
  double size = 12;
  std::string_view colour = style::ink;
  std::string_view anchor = "start";  ///< start, middle, end
  bool bold = false;
  double turn = 0;  ///< degrees, about the anchor
};

/// A picture in the making. Coordinates are pixels, y downwards, written with two decimals.
class Svg {
 public:
  Svg(double width, double height);
  void line(double x1, double y1, double x2, double y2, const Stroke& stroke);
  void polyline(std::span<const std::array<double, 2>> points, const Stroke& stroke);
  void rectangle(double x, double y, double width, double height, std::string_view fill);
  void circle(double x, double y, double radius, std::string_view fill);
  /// `content` may hold any characters; those that mean something to XML are escaped.
  void text(double x, double y, std::string_view content, const Letters& letters = {});
  /// `reference`: where its bytes are, as data within the reference.
  void image(double x, double y, double width, double height, std::string_view reference);
  /// What follows up to end_group() shares these SVG attributes, e.g. `stroke="#000"`.
  void begin_group(std::string_view attributes);
  void end_group();
  /// The finished picture; call once, last.
  std::string finish();

 private:
  std::string text_;
};

/// Width of a text in these pictures, estimated [px].
double text_width(std::string_view text, double size);

/// Ticks at 1, 2 or 5 x 10^n that cover [low, high], about `wanted` of them; at least two. low < high, both
/// finite.
std::vector<double> nice_ticks(double low, double high, int wanted);

}  // namespace talus::io::detail
