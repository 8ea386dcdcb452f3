#include "io/files/crc.hpp"

#include <zlib.h>

#include <algorithm>
#include <fstream>
#include <limits>
#include <vector>

#include "io/files/error.hpp"

namespace talus::io {

std::uint32_t crc_of(std::string_view bytes, std::uint32_t before) {
  return static_cast<std::uint32_t>(
      crc32_z(before, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

std::uint32_t crc_of_file(const std::filesystem::path& path, std::optional<std::int64_t> bytes) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw FileError(path.string(), "cannot be read");
  std::vector<char> piece(1 << 16);
  std::uint32_t sum = 0;
  for (auto left = bytes.value_or(std::numeric_limits<std::int64_t>::max()); file && left > 0;) {
    file.read(piece.data(), std::min(left, static_cast<std::int64_t>(piece.size())));
    sum = crc_of({piece.data(), static_cast<std::size_t>(file.gcount())}, sum);
    left -= file.gcount();
  }
  if (file.bad()) throw FileError(path.string(), "cannot be read");
  return sum;
}

}  // namespace talus::io
