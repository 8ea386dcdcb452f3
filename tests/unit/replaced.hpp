#pragma once

/// Texts that differ from others in one place.

#include <stdexcept>
#include <string>

namespace talus::test {

/// The text with the first `from` in it replaced; throws std::invalid_argument where there is none, as a test
/// of an unchanged text would prove nothing.
inline std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  if (at == std::string::npos) throw std::invalid_argument("nothing to replace: " + from);
  return text.replace(at, from.size(), to);
}

}  // namespace talus::test
