#pragma once

/// Lines of CSV files that a scene names.

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <string>
#include <string_view>
#include <type_traits>

#include "io/scene/scene_error.hpp"
#include "kernels/bodies/farthest.hpp"

namespace talus::io::detail {

inline std::string_view trimmed(std::string_view text) {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
  while (!text.empty() && (text.back() == ' ' || text.back() == '\t' || text.back() == '\r'))
    text.remove_suffix(1);
  return text;
}

/// The fields of a line, as many as `fields` holds; returns how many there are, at most that many.
template <std::size_t most>
std::size_t split(std::string_view line, std::array<std::string_view, most>& fields) {
  std::size_t count = 0;
  while (count < fields.size()) {
    const std::size_t comma = line.find(',');
    fields[count++] = trimmed(line.substr(0, comma));
    if (comma == std::string_view::npos) break;
    line.remove_prefix(comma + 1);
  }
  return count;
}

/// A line of the file being read, with what an error needs to say where it is.
struct CsvPlace {
  const std::string& file;
  int line;
  [[noreturn]] void fail(std::string_view column, const std::string& message) const {
    throw SceneError(file, line, std::string(column), message);
  }
};

template <class Number>
Number number_in(std::string_view field, std::string_view column, const CsvPlace& place) {
  Number value{};
  const char* const first = field.data() + (field.starts_with('+') ? 1 : 0);  // from_chars takes no plus sign
  const char* const last = field.data() + field.size();
  const auto [end, error] = std::from_chars(first, last, value);
  if (error == std::errc::result_out_of_range && end == last)
    place.fail(column, fmt::format("{} is out of the range of numbers", field));
  if (error != std::errc{} || end != last)
    place.fail(column,
               fmt::format("'{}' is not {}", field, std::is_integral_v<Number> ? "an integer" : "a number"));
  if constexpr (std::is_floating_point_v<Number>) {
    if (!std::isfinite(value)) place.fail(column, fmt::format("must be finite, got {}", field));
    if (!within_farthest(value))
      place.fail(column, fmt::format("must be within {:g}, got {}", farthest, field));
  }
  return value;
}

}  // namespace talus::io::detail
