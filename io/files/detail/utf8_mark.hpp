#pragma once

#include <cstddef>
#include <string_view>

namespace talus::io::detail {

/// Bytes of the mark by which spreadsheets and editors tell a text as UTF-8 at its beginning; 0 without one.
inline std::size_t utf8_mark_of(std::string_view text) {
  constexpr std::string_view mark = "\xef\xbb\xbf";
  return text.starts_with(mark) ? mark.size() : 0;
}

}  // namespace talus::io::detail
