#pragma once

/// Reading a results.h5 that a run may write to meanwhile.

#include <filesystem>
#include <string>
#include <system_error>

#include "io/files/error.hpp"
#include "io/results/detail/directory_undo.hpp"

namespace talus::io::detail {

/// `read()`, which throws FileError where it meets half of a frame: a writer needs milliseconds for one, and
/// its traces, directory_is_kept and the time at which the file was written, tell that it is or was there.
/// Then it looks again as long as `wait()` says that there is patience left; else the error stands.
template <class Read, class Wait>
auto read_patiently(const std::string& path, const Read& read, const Wait& wait) {
  std::error_code unknown;
  for (;;) {
    const bool begun = directory_is_kept(path);
    const auto written = std::filesystem::last_write_time(path, unknown);
    try {
      return read();
    } catch (const FileError&) {
      const bool disturbed =
          begun || directory_is_kept(path) || std::filesystem::last_write_time(path, unknown) != written;
      if (!disturbed || !wait()) throw;
    }
  }
}

}  // namespace talus::io::detail
