#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace talus::io::detail {

/// Text of errno.
std::string last_error();

/// A file descriptor that is open for writing and owned. Streams are not used for results because they forget
/// why a write failed; here every failure is a FileError with the name of the file and the system's reason.
class Descriptor {
 public:
  /// `flags` as for open(2). Throws FileError.
  Descriptor(const std::filesystem::path& path, int flags);
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor();

  /// Writes everything, going on after short writes. Throws FileError.
  void write(std::string_view bytes);

  /// The same at a place of the file [byte], of one that is not open for appending.
  void write_at(std::int64_t place, std::string_view bytes);
  /// Gets the disk's room for `bytes` from there on, without making the file longer, where the file system
  /// can tell. Throws FileError where there is none, before anything is half written.
  void demand_room(std::int64_t from, std::int64_t bytes);
  /// Keeps the first `bytes` of the file. Throws FileError, also when it has less.
  void cut(std::int64_t bytes);
  /// Gives the file that length [byte]. Throws FileError.
  void end_at(std::int64_t bytes);
  /// Returns when the disk has all that was written. Throws FileError.
  void sync();

  /// Closes and reports what the system kept for the end (quota, network file systems). Throws FileError.
  void close();

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
  int descriptor_ = -1;
};

}  // namespace talus::io::detail
