#include "io/files/stl.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string_view>
#include <system_error>

#include "io/files/detail/utf8_mark.hpp"
#include "io/files/error.hpp"

namespace talus::io {

namespace {

static_assert(std::endian::native == std::endian::little, "binary STL files are little-endian");

constexpr std::size_t head = 84, record = 50;  // bytes of a binary file and of each of its triangles

std::uint32_t count_of(const std::string& bytes) {
  std::uint32_t count = 0;
  if (bytes.size() >= head) std::memcpy(&count, bytes.data() + head - sizeof(count), sizeof(count));
  return count;
}

std::vector<Triangle> read_binary(const std::string& path, const std::string& bytes) {
  std::vector<Triangle> triangles(count_of(bytes));
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    float corner[9];
    std::memcpy(corner, bytes.data() + head + t * record + 3 * sizeof(float),
                sizeof(corner));  // behind the normal
    for (std::size_t k = 0; k < 9; ++k) {
      if (!std::isfinite(corner[k]))
        throw FileError(
            path, fmt::format("triangle {}: a coordinate is {}, not a finite number", t + 1, corner[k]));
      triangles[t][k / 3][static_cast<Eigen::Index>(k % 3)] = static_cast<double>(corner[k]);
    }
  }
  return triangles;
}

/// Whether a word is this keyword, which is given in small letters. Some programs write capitals.
bool is_keyword(std::string_view word, std::string_view keyword) {
  return std::ranges::equal(word, keyword, {}, [](char letter) {
    return static_cast<char>(std::tolower(static_cast<unsigned char>(letter)));
  });
}

/// The words of a text file, with the line of the last one.
class Words {
 public:
  Words(const std::string& path, std::string_view text) : path_(path), text_(text) {}

  /// The next word; empty at the end of the file.
  std::string_view next() {
    while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_])))
      line_ += text_[at_++] == '\n';
    const std::size_t from = at_;
    while (at_ < text_.size() && !std::isspace(static_cast<unsigned char>(text_[at_]))) ++at_;
    return text_.substr(from, at_ - from);
  }
  void expect(std::string_view wanted) {
    if (const std::string_view word = next(); !is_keyword(word, wanted)) fail(wanted, word);
  }
  double number() {
    std::string_view word = next();
    if (word.starts_with('+')) word.remove_prefix(1);
    double value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc{} || end != word.data() + word.size() || !std::isfinite(value))
      fail("a finite number", word);
    return value;
  }
  void skip_line() {
    while (at_ < text_.size() && text_[at_] != '\n') ++at_;
  }
  [[noreturn]] void fail(std::string_view wanted, std::string_view found) const {
    throw FileError(
        path_, fmt::format("line {}: expected {}, got {}", line_, wanted,
                           found.empty() ? "the end of the file" : fmt::format("'{}'", found.substr(0, 40))));
  }

 private:
  const std::string& path_;
  std::string_view text_;
  std::size_t at_ = 0, line_ = 1;
};

std::vector<Triangle> read_text(const std::string& path, std::string_view text) {
  Words words(path, text);
  words.expect("solid");
  words.skip_line();  // its name
  std::vector<Triangle> triangles;
  for (std::string_view word = words.next(); !is_keyword(word, "endsolid"); word = words.next()) {
    if (!is_keyword(word, "facet")) words.fail("facet or endsolid", word);
    words.expect("normal");
    for (int k = 0; k < 3; ++k) words.next();
    words.expect("outer");
    words.expect("loop");
    Triangle& triangle = triangles.emplace_back();
    for (Vec3& corner : triangle) {
      words.expect("vertex");
      for (double& coordinate : corner) coordinate = words.number();
    }
    words.expect("endloop");
    words.expect("endfacet");
  }
  return triangles;
}

}  // namespace

std::vector<Triangle> read_stl(const std::string& path) {
  if (std::filesystem::is_directory(path)) throw FileError(path, "is a directory, not an STL file");
  // Of a pipe the end may never come.
  if (std::filesystem::exists(path) && !std::filesystem::is_regular_file(path))
    throw FileError(path, "is no regular file");
  std::ifstream in(path, std::ios::binary);
  if (!in) throw FileError(path, "cannot be opened: " + std::generic_category().message(errno));
  std::ostringstream held;
  held << in.rdbuf();
  const std::string bytes = std::move(held).str();
  const std::uint64_t wanted = head + std::uint64_t{count_of(bytes)} * record;
  if (bytes.size() >= head && bytes.size() == wanted) return read_binary(path, bytes);
  const std::string_view text = std::string_view(bytes).substr(detail::utf8_mark_of(bytes));
  if (is_keyword(Words(path, text).next(), "solid")) return read_text(path, text);
  if (bytes.size() < head)
    throw FileError(
        path, fmt::format("is no STL file: it has {} bytes and does not begin with 'solid'", bytes.size()));
  throw FileError(
      path, fmt::format("does not begin with 'solid', and as a binary STL file it would have {} triangles, "
                        "{} bytes in all, but has {} bytes: those of {} triangles",
                        count_of(bytes), wanted, bytes.size(), (bytes.size() - head) / record));
}

std::string stl_text(const std::vector<Triangle>& triangles) {
  std::string text = "solid talus\n";
  for (const Triangle& triangle : triangles) {
    text += "facet normal 0 0 0\nouter loop\n";
    for (const Vec3& p : triangle) text += fmt::format("vertex {} {} {}\n", p[0], p[1], p[2]);
    text += "endloop\nendfacet\n";
  }
  return text + "endsolid\n";
}

}  // namespace talus::io
