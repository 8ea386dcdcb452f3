#pragma once

/// Samples and checks that the tests of the output share.

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/step/frame.hpp"
#include "runtime/step/setup.hpp"

namespace talus::test {

/// An empty directory of its own, gone with the object.
class ScratchDirectory {
 public:
  ScratchDirectory() {
    std::string name = (std::filesystem::temp_directory_path() / "talus-test-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error("no directory for the test: " + name);
    path_ = name;
  }
  ScratchDirectory(const ScratchDirectory&) = delete;
  ScratchDirectory& operator=(const ScratchDirectory&) = delete;
  ~ScratchDirectory() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

/// While it lives, files of this process cannot grow beyond `bytes`: what a full disk or a quota looks like.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    rlimit limit = before_;
    limit.rlim_cur = bytes;
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;
  ~FileSizeLimit() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }

 private:
  rlimit before_{};
  void (*handler_)(int);
};

inline std::string content_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

inline std::vector<std::string> split(std::string_view text, char separator) {
  std::vector<std::string> parts;
  while (true) {
    const std::size_t end = text.find(separator);
    parts.emplace_back(text.substr(0, end));
    if (end == std::string_view::npos) return parts;
    text.remove_prefix(end + 1);
  }
}

inline std::size_t occurrences(std::string_view text, std::string_view word) {
  std::size_t count = 0;
  for (std::size_t at = text.find(word); at != std::string_view::npos; at = text.find(word, at + word.size()))
    ++count;
  return count;
}

/// What `action` throws as an Error, or "" if it throws nothing.
template <class Error, class Action>
std::string message_of(Action action) {
  try {
    action();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

/// The numbers of an inline base64 array: its element count times, after the 64-bit length.
template <class T>
std::vector<T> array_of(const std::string& text, const std::string& name) {
  const std::size_t tag = text.find("Name=\"" + name + "\"");
  if (tag == std::string::npos) return {};
  const std::size_t begin = text.find('>', tag) + 1;
  const std::string encoded = text.substr(begin, text.find('<', begin) - begin);
  static const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  std::uint32_t group = 0;
  int bits = 0;
  for (const char c : encoded) {
    if (c == '=') break;
    group = group << 6 | static_cast<std::uint32_t>(digits.find(c));
    if ((bits += 6) >= 8) {
      bytes += static_cast<char>(group >> (bits -= 8) & 255);
    }
  }
  std::uint64_t length = 0;
  EXPECT_GE(bytes.size(), sizeof(length));
  std::memcpy(&length, bytes.data(), sizeof(length));
  EXPECT_EQ(bytes.size(), sizeof(length) + length) << name;
  std::vector<T> values(length / sizeof(T));
  if (length > 0) std::memcpy(values.data(), bytes.data() + sizeof(length), length);
  return values;
}

/// A floor and a left wall.
inline Setup setup_with_two_walls() {
  Setup setup;
  setup.walls.resize(2);
  setup.walls[0].name = "bottom";
  setup.walls[1].name = "left";
  setup.walls[1].normal = Vec3::UnitX();
  setup.stages.resize(1);
  setup.stages[0].name = "shear";
  return setup;
}

/// Three grains of ids 7, 3 and 11; a contact between 7 and 3, and one of 11 with the floor. Values with all
/// bits in use.
inline Frame three_grains() {
  Frame frame;
  frame.step = 12;
  frame.time = 0.1;
  frame.stage = "shear";
  frame.id = {7, 3, 11};
  frame.x = {Vec3(0.1, 0.2, 1.0 / 3), Vec3(0.3, 0.2, 0.4), Vec3(0.7, 0.25, 0.09)};
  frame.radius = {0.1, 0.11, 0.1 / 3};
  frame.u = {Vec3(1e-300, -0.0, 3), Vec3(4, 5, 6), Vec3(7, 8, 9)};
  frame.omega = {Vec3(1, 2, 3), Vec3(-1, -2, -3), Vec3(0, 0, 5e-324)};
  frame.contact_bodies = {{7, 3}, {11, -1}};
  frame.contact_point = {Vec3(0.2, 0.2, 0.36), Vec3(0.7, 0.25, 0)};
  frame.contact_normal = {Vec3(-1, 0, 0), Vec3(0, 0, 1)};
  frame.contact_gap = {-1e-9, std::numeric_limits<double>::epsilon()};
  frame.contact_force = {Vec3(-2.5, 0.5, 0), Vec3(0, 0, 1.25)};
  frame.walls = {WallReport{"bottom", 0, 0, Vec3(0, 0, 1.25)}, WallReport{"left", -0.5, 0.125, Vec3::Zero()}};
  return frame;
}

inline TriaxialReport triaxial_row(std::int64_t step, const std::string& stage) {
  TriaxialReport report;
  report.step = step;
  report.stage = stage;
  return report;
}

/// Every opened element is closed in order; enough to catch what an XML parser would refuse in files we
/// write.
inline bool well_formed(const std::string& text) {
  std::vector<std::string> open;
  for (std::size_t at = text.find('<'); at != std::string::npos; at = text.find('<', at + 1)) {
    const std::size_t end = text.find('>', at);
    if (end == std::string::npos) return false;
    const std::string tag = text.substr(at + 1, end - at - 1);
    if (tag.starts_with('?') || tag.ends_with('/')) continue;
    const std::string name = tag.substr(0, tag.find_first_of(" \n"));
    if (name.starts_with('/')) {
      if (open.empty() || "/" + open.back() != name) return false;
      open.pop_back();
    } else {
      open.push_back(name);
    }
  }
  return open.empty();
}

}  // namespace talus::test
