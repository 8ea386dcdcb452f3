#include "io/files/output_directory.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdlib>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "io/files/detail/descriptor.hpp"
#include "io/files/error.hpp"

namespace talus::io {
namespace {

namespace fs = std::filesystem;

/// A symbolic link in the place of a file or folder that a run may write, relative; empty: there is none.
/// Files are opened by name, so that results would go where it leads.
fs::path link_in_the_way(const fs::path& directory, IsOutputName is_ours) {
  for (const char* folder : {"fields", "traces"})
    if (fs::is_symlink(directory / folder)) return folder;
  for (const fs::path& folder : {directory, directory / "fields", directory / "traces"}) {
    if (!fs::is_directory(folder)) continue;
    for (const auto& entry : fs::directory_iterator(folder)) {
      const fs::path relative = entry.path().lexically_relative(directory);
      if (entry.is_symlink() && is_ours(whole_name(relative.generic_string()))) return relative;
    }
  }
  return {};
}

/// Under whatever name. A file that is not there is none of them.
bool is_one_of(const fs::path& file, const std::vector<fs::path>& files) {
  std::error_code unknown;
  return std::ranges::any_of(files, [&](const fs::path& one) { return fs::equivalent(file, one, unknown); });
}

void demand_no_input(const fs::path& directory, const std::vector<fs::path>& former,
                     const std::vector<fs::path>& inputs) {
  for (const fs::path& relative : former)
    if (is_one_of(directory / relative, inputs))
      throw FileError((directory / relative).string(),
                      "is still to be read, and would be removed with the former results; choose another "
                      "directory with --out");
}

}  // namespace

std::string whole_name(std::string name) {
  if (!name.ends_with(unfinished_ending)) return name;
  name.resize(name.size() - unfinished_ending.size());
  const std::size_t digits = name.find_last_not_of("0123456789") + 1;
  if (digits > 1 && digits < name.size() && name[digits - 1] == '.') name.resize(digits - 1);
  return name;
}

bool is_numbered_name(std::string_view name, std::string_view prefix, std::string_view suffix) {
  if (!name.starts_with(prefix) || !name.ends_with(suffix)) return false;
  if (name.size() < prefix.size() + suffix.size() + 6) return false;
  const auto digits = name.substr(prefix.size(), name.size() - prefix.size() - suffix.size());
  return std::ranges::all_of(digits, [](unsigned char c) { return std::isdigit(c) != 0; });
}

DirectoryLock::DirectoryLock(const fs::path& directory)
    : descriptor_(::open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
  if (descriptor_ < 0 || ::flock(descriptor_, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) return;
  ::close(descriptor_);
  throw FileError(directory.string(),
                  "another run is writing there; wait for its end, or choose another directory with --out");
}

DirectoryLock::DirectoryLock(DirectoryLock&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)) {}

DirectoryLock::~DirectoryLock() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

std::vector<fs::path> outputs_in(const fs::path& directory, IsOutputName is_ours) {
  std::vector<fs::path> found;
  for (const fs::path& folder : {directory, directory / "fields", directory / "traces"}) {
    if (!fs::is_directory(folder) || (folder != directory && fs::is_symlink(folder))) continue;
    for (const auto& entry : fs::directory_iterator(folder)) {
      if (entry.is_symlink() || !entry.is_regular_file()) continue;
      const fs::path relative = entry.path().lexically_relative(directory);
      if (is_ours(whole_name(relative.generic_string()))) found.push_back(relative);
    }
  }
  return found;
}

DirectoryLock prepare_output_directory(const fs::path& directory, bool force, IsOutputName is_ours,
                                       const std::vector<fs::path>& inputs, const fs::path& last) {
  try {
    if (fs::exists(directory) && !fs::is_directory(directory)) {
      throw FileError(directory.string(), "is a file, not a directory; give another name with --out");
    }
    if (!fs::exists(directory) && fs::is_symlink(directory))
      throw FileError(directory.string(),
                      "is a symbolic link that leads nowhere; make the folder it names, or give another name "
                      "with --out");
    fs::create_directories(directory);
    DirectoryLock lock(directory);
    if (!fs::is_empty(directory)) {
      if (!force) {
        throw FileError(
            directory.string(),
            "exists and is not empty; choose another directory with --out, or replace the results in "
            "it with --force");
      }
      if (const fs::path link = link_in_the_way(directory, is_ours); !link.empty())
        throw FileError((directory / link).string(),
                        "is a symbolic link, and results would be written where it leads; remove it, or "
                        "choose another directory with --out");
      std::vector<fs::path> former = outputs_in(directory, is_ours);
      demand_no_input(directory, former, inputs);
      std::stable_partition(former.begin(), former.end(),
                            [&](const fs::path& relative) { return relative != last; });
      for (const fs::path& relative : former) fs::remove(directory / relative);
    }
    // Asked before the run starts, not an hour later when the first file is written.
    if (::access(directory.c_str(), W_OK | X_OK) != 0)
      throw FileError(directory.string(), "cannot write into this directory: " + detail::last_error());
    return lock;
  } catch (const fs::filesystem_error& error) {
    const fs::path& culprit = error.path1().empty() ? directory : error.path1();
    throw FileError(culprit.string(), "cannot prepare the directory of the run: " + error.code().message());
  }
}

ScratchFolder::ScratchFolder(const fs::path& prefix) {
  std::error_code error;
  if (prefix.has_parent_path()) fs::create_directories(prefix.parent_path(), error);
  std::string name = prefix.string() + "-XXXXXX";
  if (error || !::mkdtemp(name.data()))
    throw FileError(name, "cannot make this folder: " + (error ? error.message() : detail::last_error()));
  path_ = name;
}

ScratchFolder::~ScratchFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

void check_output_files(const std::vector<fs::path>& inputs, const std::vector<fs::path>& outs, bool force) {
  std::error_code error;
  std::vector<fs::path> places;
  for (const fs::path& out : outs) {
    if (out.empty()) continue;
    if (is_one_of(out, inputs))
      throw FileError(out.string(), "is what is read, and would be overwritten; give another name");
    if (fs::is_directory(out, error)) throw FileError(out.string(), "is a folder; give the name of a file");
    const fs::path folder = fs::absolute(out).parent_path();
    if (!fs::is_directory(folder, error))
      throw FileError(out.string(),
                      "cannot be written, there is no folder " + folder.string() + "; make it first");
    if (fs::exists(out, error) && !fs::is_regular_file(out, error))
      throw FileError(out.string(), "is no regular file; give the name of a file");
    if (!force && fs::exists(out, error))
      throw FileError(out.string(), "exists; give another name, or replace it with --force");
    // Of a relative path without a folder the function would leave it so, and "./a" be another than "a".
    places.push_back(fs::weakly_canonical(fs::absolute(out), error));
    if (std::ranges::count(places, places.back()) > 1)
      throw FileError(out.string(), "is asked for twice; give every output a name of its own");
  }
}

namespace {

/// What `write` makes under an unfinished name takes the place of `path`. What it throws goes on.
template <class Write>
void replace_by_draft(const fs::path& path, const Write& write) {
  fs::path draft = path;
  draft += unfinished_ending;
  const auto discard = [&] {
    std::error_code ignored;
    fs::remove(draft, ignored);
  };
  try {
    write(draft);
  } catch (...) {
    discard();
    throw;
  }
  std::error_code error;
  fs::rename(draft, path, error);
  if (!error) return;
  discard();
  throw FileError(path.string(), "cannot be replaced: " + error.message());
}

}  // namespace

void write_whole(const fs::path& path, const std::function<void(const WriteText&)>& content) {
  replace_by_draft(path, [&](const fs::path& draft) {
    detail::Descriptor file(draft, O_WRONLY | O_CREAT | O_TRUNC);
    content([&](std::string_view text) { file.write(text); });
    file.close();
  });
}

void write_by_draft(const fs::path& path, const std::function<void(const fs::path&)>& write) {
  replace_by_draft(path, [&](const fs::path& draft) {
    try {
      write(draft);
    } catch (const fs::filesystem_error& failure) {
      throw FileError(path.string(), "cannot be written: " + failure.code().message() +
                                         "; check the folder's rights and room");
    }
  });
}

void write_whole(const fs::path& path, std::string_view content) {
  write_whole(path, [&](const WriteText& out) { out(content); });
}

void write_whole_or_over(const fs::path& path, std::string_view content) {
  try {
    write_whole(path, content);
  } catch (const FileError&) {
    std::error_code unknown;
    if (!fs::is_regular_file(path, unknown)) throw;
    detail::Descriptor file(path, O_WRONLY);
    file.demand_room(0, static_cast<std::int64_t>(content.size()));
    file.write_at(0, content);
    file.end_at(static_cast<std::int64_t>(content.size()));
    file.close();
  }
}

void reserve(const fs::path& path, std::int64_t bytes) {
  detail::Descriptor file(path, O_WRONLY);
  file.demand_room(0, bytes);
  file.close();
}

}  // namespace talus::io
