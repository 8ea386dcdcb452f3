#pragma once

#include <fmt/format.h>

#include <stdexcept>
#include <string>

namespace talus::io {

/// The user's mistake in a scene, an override or a file of bodies. what() reads "file:line: key: what is
/// wrong and what was meant"; parts that are not known are left out.
class SceneError : public std::runtime_error {
 public:
  /// `file`: path as the user gave it, or the text of the override ("--set a.b=c"); `line`: from 1, 0 when
  /// there is none; `key`: path of the key or name of the column, may be empty.
  SceneError(const std::string& file, int line, const std::string& key, const std::string& message)
      : std::runtime_error(fmt::format("{}{}: {}{}", file, line > 0 ? fmt::format(":{}", line) : "",
                                       key.empty() ? "" : key + ": ", message)),
        file_(file),
        line_(line),
        key_(key) {}

  const std::string& file() const { return file_; }
  int line() const { return line_; }
  const std::string& key() const { return key_; }

 private:
  std::string file_;
  int line_;
  std::string key_;
};

}  // namespace talus::io
