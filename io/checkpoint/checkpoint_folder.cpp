#include "io/checkpoint/checkpoint_folder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <string_view>
#include <system_error>

#include "io/files/output_directory.hpp"

namespace talus::io {

namespace {

namespace fs = std::filesystem;

constexpr std::string_view rolling = "checkpoint_", archive = "archive_", ending = ".h5";

/// Of a checkpoint's name.
std::int64_t step_of(const fs::path& path) {
  const std::string name = path.filename().string();
  return std::atoll(name.c_str() + name.find('_') + 1);
}

bool is_rolling(const std::string& name) {
  return is_numbered_name(name, rolling, ending);
}

}  // namespace

std::string checkpoint_name(std::int64_t step, bool archived) {
  return fmt::format("{}{:06}{}", archived ? archive : rolling, step, ending);
}

bool is_checkpoint_name(const std::string& name) {
  return is_rolling(name) || is_numbered_name(name, archive, ending);
}

std::vector<fs::path> checkpoints_in(const fs::path& directory) {
  std::vector<fs::path> found;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(directory, error))
    if (is_checkpoint_name(entry.path().filename().string())) found.push_back(entry.path());
  std::ranges::sort(found, [](const fs::path& a, const fs::path& b) {
    return step_of(a) != step_of(b) ? step_of(a) > step_of(b) : a < b;
  });
  return found;
}

void remove_old_checkpoints(const fs::path& directory, int keep) {
  std::error_code ignored;
  int kept = 0;
  for (const fs::path& path : checkpoints_in(directory))
    if (is_rolling(path.filename().string()) && ++kept > keep) fs::remove(path, ignored);
  for (const auto& entry : fs::directory_iterator(directory, ignored)) {
    const std::string name = entry.path().filename().string(), whole = whole_name(name);
    if (whole != name && is_checkpoint_name(whole)) fs::remove(entry.path(), ignored);
  }
}

}  // namespace talus::io
