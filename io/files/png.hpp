#pragma once

/// Images of 8 bits a channel, as PNG.

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace talus::io {

struct Image {
  std::size_t width = 0, height = 0;  ///< [px]
  std::vector<std::uint8_t> rgb;      ///< row by row from the top, three bytes a pixel
};

/// The bytes of a PNG file (ISO/IEC 15948). Throws std::invalid_argument where `rgb` does not fit the size.
std::string png_bytes(const Image& image);

}  // namespace talus::io
