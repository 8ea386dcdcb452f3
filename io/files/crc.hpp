#pragma once

/// CRC-32 of bytes and files, by which a run knows its own files again.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string_view>

namespace talus::io {

/// How far a file that grows had come.
struct FileMark {
  std::int64_t bytes = 0;
  std::uint32_t crc = 0;  ///< of these bytes
};

/// CRC-32 (ISO 3309, that of zlib and PNG) of bytes that follow those with the CRC `before`.
std::uint32_t crc_of(std::string_view bytes, std::uint32_t before = 0);

/// Of the first `bytes` of a file, of all it has without that or where it has fewer. Throws FileError when it
/// cannot be read.
std::uint32_t crc_of_file(const std::filesystem::path& path, std::optional<std::int64_t> bytes = {});

}  // namespace talus::io
