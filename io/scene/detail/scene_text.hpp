#pragma once

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <string>

#include "io/scene/detail/scene_key.hpp"
#include "io/scene/detail/spelling.hpp"
#include "io/scene/detail/toml_document.hpp"
#include "kernels/bodies/farthest.hpp"

namespace talus::io::detail {

/// The value as TOML; "" for none. Reals get the shortest text that reads back to the same bits.
inline std::string toml_text(double value) {
  std::string text = fmt::format("{}", value);
  if (text.find_first_of(".einf") == std::string::npos) text += ".0";
  return text;
}
inline std::string toml_text(std::monostate) {
  return "";
}
inline std::string toml_text(bool value) {
  return value ? "true" : "false";
}
inline std::string toml_text(std::int64_t value) {
  return fmt::format("{}", value);
}
inline std::string toml_text(const std::string& value) {
  return quoted(value);
}
template <class T>
std::string toml_text(const std::vector<T>& values) {
  std::vector<std::string> texts;
  for (const T& value : values) texts.push_back(toml_text(value));
  return fmt::format("[{}]", listed(texts));
}

/// Why a file cannot be read.
inline std::string fault_of_file(const std::filesystem::path& file) {
  return fmt::format("{}: {}", std::filesystem::is_directory(file) ? "is a directory" : "no such file",
                     file.string());
}

/// What `part` holds for the key, as TOML; "" when it holds nothing.
template <class Part>
std::string text_of(const Key<Part>& key, const Part& part) {
  const Value value = key.get(part);
  if (const double* real = std::get_if<double>(&value); real && key.automatic)
    if (*real == *key.automatic || (std::isnan(*real) && std::isnan(*key.automatic))) return "\"auto\"";
  return std::visit([](const auto& held) { return toml_text(held); }, value);
}

/// "real", "integer", "list of 3 reals", "one of a, b, c", ...
inline std::string type_text(const KeyText& key) {
  struct Name {
    std::string operator()(std::monostate) const { return ""; }
    std::string operator()(bool) const { return "true or false"; }
    std::string operator()(std::int64_t) const { return "integer"; }
    std::string operator()(double) const { return "real"; }
    std::string operator()(const std::string&) const { return "text"; }
    std::string operator()(const std::vector<std::int64_t>& list) const {
      return fmt::format("list of {} integers", list.size());
    }
    std::string operator()(const std::vector<double>& list) const {
      return list.empty() ? "list of reals" : fmt::format("list of {} reals", list.size());
    }
  };
  return key.choices.empty() ? std::visit(Name{}, key.kind) : "one of " + listed(key.choices);
}

/// What the file must hold, with the unit: "real [m] or "auto"".
inline std::string expected_text(const KeyText& key) {
  return fmt::format("{}{}{}", type_text(key), key.unit.empty() ? "" : fmt::format(" [{}]", key.unit),
                     key.automatic ? " or \"auto\"" : "");
}

/// "> 0", ">= 1", "0 to 1"; "" when every finite number will do.
inline std::string range_text(const Range& range) {
  if (std::isinf(range.low)) return "";
  if (std::isfinite(range.high)) {
    const bool zeros = range.high >= farthest;  // of a power of ten
    return zeros ? fmt::format("{} to {:g}", range.low, range.high)
                 : fmt::format("{} to {}", range.low, range.high);
  }
  return fmt::format("{} {}", range.without_low ? ">" : ">=", range.low);
}

}  // namespace talus::io::detail
