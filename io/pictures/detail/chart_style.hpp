#pragma once

#include <array>
#include <cstddef>
#include <string_view>

namespace talus::io::detail {

/// Colours that are told apart in print and by the colour-blind, dark enough on white.
inline constexpr std::array<std::string_view, 8> hues{"#1d5fa8", "#c8511b", "#2a7f4f", "#7b4ba0",
                                                      "#b8860b", "#2a93a8", "#b83b74", "#55606b"};
inline constexpr std::array<std::string_view, 5> patterns{"", "7 4", "2 3", "9 3 2 3", "14 4"};

inline std::string_view hue(std::size_t k) {
  return hues[k % hues.size()];
}
inline std::string_view dashes(std::size_t k) {
  return patterns[k % patterns.size()];
}

}  // namespace talus::io::detail
