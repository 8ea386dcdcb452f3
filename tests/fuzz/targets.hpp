#pragma once

/// The readers of files, each as a function of bytes that anybody may have made: they read, or throw the
/// error that says what is wrong with the file. Whatever else happens is a defect. tests/README.md says how
/// they are run.

#include <cstdint>
#include <span>
#include <string_view>

namespace talus::fuzz {

using Bytes = std::span<const std::uint8_t>;

/// All return whether the bytes were read; false: they were refused.
bool read_scene(Bytes bytes);
bool read_bodies(Bytes bytes);
bool read_mesh(Bytes bytes);
bool read_fclib(Bytes bytes);
bool read_results(Bytes bytes);
bool read_checkpoint(Bytes bytes);
bool read_trace(Bytes bytes);

struct Target {
  std::string_view name;  ///< that of its folder in tests/fuzz/corpus
  bool (*read)(Bytes);
};
inline constexpr Target targets[] = {
    {"scene", read_scene},     {"bodies", read_bodies},         {"mesh", read_mesh},   {"fclib", read_fclib},
    {"results", read_results}, {"checkpoint", read_checkpoint}, {"trace", read_trace},
};

}  // namespace talus::fuzz
