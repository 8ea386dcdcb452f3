#include "io/files/detail/csv_cell.hpp"

#include <fmt/format.h>

#include <iterator>

namespace talus::io::detail {

void put(std::string& text, double value) {
  fmt::format_to(std::back_inserter(text), "{}", value);
}
void put(std::string& text, std::int64_t value) {
  fmt::format_to(std::back_inserter(text), "{}", value);
}
void put(std::string& text, int value) {
  put(text, std::int64_t{value});
}
void put(std::string& text, bool value) {
  text += value ? '1' : '0';
}
void put(std::string& text, std::string_view value) {
  if (value.find_first_of(",\"\r\n") == std::string_view::npos) {
    text += value;
    return;
  }
  text += '"';
  for (const char c : value) {
    if (c == '"') text += '"';
    text += c;
  }
  text += '"';
}
void put(std::string& text, const std::string& value) {
  put(text, std::string_view(value));
}
void put(std::string& text, const char* value) {
  put(text, std::string_view(value));
}

}  // namespace talus::io::detail
