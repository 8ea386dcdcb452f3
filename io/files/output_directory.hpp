#pragma once

/// The directory of a run: which files may be overwritten, and how files appear in it.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "io/files/write_text.hpp"

namespace talus::io {

/// Tells from the name of a whole file, relative to a directory, whether a command of Talus wrote it.
using IsOutputName = bool (*)(const std::string& name);

/// Ends the name of a file that is being written.
inline constexpr std::string_view unfinished_ending = ".part";
/// The name that a file has when it is whole: without ".part", or ".PID.part".
std::string whole_name(std::string name);

/// True for `prefix`, six digits or more, `suffix`.
bool is_numbered_name(std::string_view name, std::string_view prefix, std::string_view suffix);

/// Locks a directory while a run writes to it. The system releases the lock when the process ends, however it
/// ends, and nothing is left in the directory.
class DirectoryLock {
 public:
  /// Throws FileError when another process holds the lock. On file systems without such locks nothing is
  /// locked.
  explicit DirectoryLock(const std::filesystem::path& directory);
  DirectoryLock(DirectoryLock&& other) noexcept;
  DirectoryLock& operator=(DirectoryLock&&) = delete;
  ~DirectoryLock();

 private:
  int descriptor_ = -1;
};

/// Regular files in `directory` that `is_ours` knows, and their unfinished forms, relative names. Symbolic
/// links are the user's and are not among them. Throws std::filesystem::filesystem_error.
std::vector<std::filesystem::path> outputs_in(const std::filesystem::path& directory, IsOutputName is_ours);

/// Makes `directory` (and its parents) ready for a run, which holds the lock until it has written all. An
/// existing directory with anything in it is refused without `force`, and nothing is touched. With `force`
/// only files that `is_ours` knows are removed, and their unfinished forms, which end in ".part", among them
/// `last` behind the others, as it says whose they are; whatever else the user keeps there stays. Nothing is
/// removed where one of them is among the `inputs`, which are still to be read. Throws FileError naming that
/// file; naming the link when a symbolic link stands in the place of results, which would be written where it
/// leads; naming the directory when it is refused, when another run is writing there, or when it is not a
/// directory, or cannot be created or written to.
[[nodiscard]] DirectoryLock prepare_output_directory(const std::filesystem::path& directory, bool force,
                                                     IsOutputName is_ours,
                                                     const std::vector<std::filesystem::path>& inputs,
                                                     const std::filesystem::path& last = {});

/// A fresh folder `prefix`-XXXXXX, removed at the end of the scope with all that is in it by then.
class ScratchFolder {
 public:
  /// Makes the folder's parents too. Throws FileError.
  explicit ScratchFolder(const std::filesystem::path& prefix);
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// Throws FileError when one of `outs` cannot be meant as a file to write: it is one of the inputs or of the
/// other outs (under whatever name), no regular file, or a file that is there already and `force` is false,
/// or its folder is not there. Empty names are skipped. Call it before long work.
void check_output_files(const std::vector<std::filesystem::path>& inputs,
                        const std::vector<std::filesystem::path>& outs, bool force);

/// Writes a whole file: under `path` + ".part", then renamed, so that a reader meets the old file or the new
/// one and never half of one. Throws FileError naming `path`; the unfinished file is then removed.
void write_whole(const std::filesystem::path& path, std::string_view content);
/// The same; where the disk has no room for a second file, the text takes the place of that in the first, if
/// it can. Throws FileError.
void write_whole_or_over(const std::filesystem::path& path, std::string_view content);
/// Keeps room on the disk for a file to become so long, where the file system can. Throws FileError where
/// there is none.
void reserve(const std::filesystem::path& path, std::int64_t bytes);

/// The same for content that is made piece by piece: `content` calls its argument with the text in order.
/// What it throws goes on, and the unfinished file is removed.
void write_whole(const std::filesystem::path& path, const std::function<void(const WriteText&)>& content);
/// The same for a file that others write, HDF5 above all: `write` makes it under the unfinished name.
void write_by_draft(const std::filesystem::path& path,
                    const std::function<void(const std::filesystem::path& draft)>& write);

}  // namespace talus::io
