#include "io/files/png.hpp"

#include <zlib.h>

#include <stdexcept>
#include <string_view>

#include "io/files/crc.hpp"

namespace talus::io {
namespace {

void append_number(std::string& text, std::uint32_t number) {
  for (const int shift : {24, 16, 8, 0}) text += static_cast<char>(number >> shift & 0xff);
}

/// Length, name, content and their checksum.
void append_chunk(std::string& file, std::string_view name, const std::string& content) {
  append_number(file, static_cast<std::uint32_t>(content.size()));
  const std::string checked = std::string(name) + content;
  file += checked;
  append_number(file, crc_of(checked));
}

/// Each row behind the number of its filter: 1, differences from the pixel before.
std::string filtered_rows(const Image& image) {
  constexpr std::size_t channels = 3;
  std::string rows;
  rows.reserve(image.height * (image.width * channels + 1));
  for (std::size_t y = 0; y < image.height; ++y) {
    rows += '\1';
    const std::uint8_t* row = image.rgb.data() + y * image.width * channels;
    for (std::size_t k = 0; k < image.width * channels; ++k)
      rows += static_cast<char>(static_cast<std::uint8_t>(row[k] - (k < channels ? 0 : row[k - channels])));
  }
  return rows;
}

}  // namespace

std::string png_bytes(const Image& image) {
  if (image.rgb.size() != 3 * image.width * image.height || image.rgb.empty())
    throw std::invalid_argument("image: its bytes do not fit its size");
  const std::string rows = filtered_rows(image);
  uLongf length = compressBound(static_cast<uLong>(rows.size()));
  std::string packed(length, '\0');
  if (compress2(reinterpret_cast<Bytef*>(packed.data()), &length, reinterpret_cast<const Bytef*>(rows.data()),
                static_cast<uLong>(rows.size()), 6) != Z_OK)
    throw std::runtime_error("image: zlib could not compress it");
  packed.resize(length);
  std::string file = "\x89PNG\r\n\x1a\n", head;
  append_number(head, static_cast<std::uint32_t>(image.width));
  append_number(head, static_cast<std::uint32_t>(image.height));
  head += {'\x08', '\x02', '\0', '\0', '\0'};  // 8 bits, red green blue, no interlacing
  append_chunk(file, "IHDR", head);
  append_chunk(file, "IDAT", packed);
  append_chunk(file, "IEND", "");
  return file;
}

}  // namespace talus::io
