#pragma once

#include <stdexcept>
#include <string>

namespace talus::io {

/// A file that cannot be read or written. The message is "file: what": what happened to which file, and what
/// to do about it.
class FileError : public std::runtime_error {
 public:
  FileError(const std::string& file, const std::string& what_and_remedy)
      : std::runtime_error(file + ": " + what_and_remedy) {}
};

}  // namespace talus::io
