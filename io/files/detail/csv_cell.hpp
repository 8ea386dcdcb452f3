#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace talus::io::detail {

/// Appends a value as the cell of a CSV table: numbers as the shortest text that reads back as the same, true
/// and false as 1 and 0, texts quoted only where they must be (RFC 4180).
void put(std::string& text, double value);
void put(std::string& text, std::int64_t value);
void put(std::string& text, int value);
void put(std::string& text, bool value);
void put(std::string& text, std::string_view value);
void put(std::string& text, const std::string& value);
void put(std::string& text, const char* value);

}  // namespace talus::io::detail
