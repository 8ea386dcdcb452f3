#include "io/results/detail/directory_undo.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <set>
#include <string_view>
#include <system_error>
#include <vector>

#include "io/files/detail/descriptor.hpp"
#include "io/files/error.hpp"
#include "io/files/output_directory.hpp"

namespace talus::io::detail {

namespace {

constexpr std::string_view magic = "talus-undo 1\n";

std::string undo_name(const std::string& path) {
  return path + ".undo";
}

struct Range {
  std::uint64_t begin, size;
};

/// Reads a file that another library may have written in another way: what does not fit ends the walk.
class DirectoryWalk {
 public:
  explicit DirectoryWalk(const std::string& path) : file_(path, std::ios::binary) {}

  /// Superblock and directory of /frames; empty for a file of another version.
  std::vector<Range> ranges() {
    constexpr std::uint64_t superblock = 96;
    const std::string block = bytes(0, superblock);
    if (block.size() != superblock || block.compare(1, 3, "HDF") != 0 || block[8] != 0 || block[13] != 8 ||
        block[14] != 8)
      return {};
    leaf_ = 2 * number<std::uint16_t>(block, 16);
    internal_ = 2 * number<std::uint16_t>(block, 18);
    ranges_ = {{0, superblock}};
    if (number<std::uint32_t>(block, 72) != 1) return {};  // the root's tree and heap are not in the block
    const std::uint64_t tree = number<std::uint64_t>(block, 80), heap = number<std::uint64_t>(block, 88);
    const std::string names = heap_data(heap, false);
    std::optional<std::array<std::uint64_t, 2>> frames;
    walk(tree, [&](const std::string& leaf, std::size_t entry) {
      const std::uint64_t name = number<std::uint64_t>(leaf, entry);
      if (name < names.size() && std::string_view(names.c_str() + name) == "frames" &&
          number<std::uint32_t>(leaf, entry + 16) == 1)
        frames = {number<std::uint64_t>(leaf, entry + 24), number<std::uint64_t>(leaf, entry + 32)};
    });
    if (!frames) return {};
    heap_data((*frames)[1], true);
    walk((*frames)[0], [](const std::string&, std::size_t) {});
    return sound_ ? ranges_ : std::vector<Range>();
  }

 private:
  std::string bytes(std::uint64_t begin, std::uint64_t size) {
    std::string read(size, '\0');
    file_.clear();
    file_.seekg(static_cast<std::streamoff>(begin));
    file_.read(read.data(), static_cast<std::streamsize>(size));
    read.resize(static_cast<std::size_t>(file_.gcount()));
    if (read.size() != size) sound_ = false;
    read.resize(size);
    return read;
  }
  template <class Number>
  static Number number(const std::string& from, std::size_t at) {
    Number value{};
    if (at + sizeof(value) <= from.size()) std::memcpy(&value, from.data() + at, sizeof(value));
    return value;
  }
  std::string heap_data(std::uint64_t at, bool kept) {
    constexpr std::uint64_t header = 32, most = 1 << 28;
    const std::string heap = bytes(at, header);
    const std::uint64_t size = number<std::uint64_t>(heap, 8), data = number<std::uint64_t>(heap, 24);
    if (heap.compare(0, 4, "HEAP") != 0 || size > most) {
      sound_ = false;
      return {};
    }
    if (kept) ranges_.insert(ranges_.end(), {{at, header}, {data, size}});
    return bytes(data, size);
  }
  /// Nodes and leaves are kept; visit(leaf, place of an entry) for each entry.
  template <class Visit>
  void walk(std::uint64_t at, const Visit& visit) {
    if (!sound_ || !seen_.insert(at).second) return;
    const std::uint64_t size = 24 + 8 * (2 * internal_ + 1);
    const std::string node = bytes(at, size);
    if (node.compare(0, 4, "SNOD") == 0) {
      const std::uint64_t leaf_size = 8 + 40 * leaf_;
      const std::string leaf = bytes(at, leaf_size);
      ranges_.push_back({at, leaf_size});
      for (std::size_t k = 0; k < number<std::uint16_t>(leaf, 6); ++k) visit(leaf, 8 + 40 * k);
      return;
    }
    if (node.compare(0, 4, "TREE") != 0) {
      sound_ = false;
      return;
    }
    ranges_.push_back({at, size});
    for (std::size_t k = 0; k < number<std::uint16_t>(node, 6); ++k)
      walk(number<std::uint64_t>(node, 32 + 16 * k), visit);
  }

  std::ifstream file_;
  std::uint64_t leaf_ = 0, internal_ = 0;
  std::vector<Range> ranges_;
  std::set<std::uint64_t> seen_;
  bool sound_ = true;
};

void append_number(std::string& text, std::uint64_t value) {
  text.append(reinterpret_cast<const char*>(&value), sizeof(value));
}

}  // namespace

void keep_directory(const std::string& path) {
  const std::vector<Range> ranges = DirectoryWalk(path).ranges();
  if (ranges.empty()) return;
  std::string text(magic);
  std::error_code unknown;
  append_number(text, std::filesystem::file_size(path, unknown));
  if (unknown) return;
  std::ifstream file(path, std::ios::binary);
  for (const auto& [begin, size] : ranges) {
    append_number(text, begin);
    append_number(text, size);
    std::string bytes(size, '\0');
    file.clear();
    file.seekg(static_cast<std::streamoff>(begin));
    file.read(bytes.data(), static_cast<std::streamsize>(size));
    text += bytes;
  }
  try {
    write_whole(undo_name(path), text);
  } catch (const FileError&) {
    // A full disk is told of by the frame itself.
  }
}

void drop_directory(const std::string& path) {
  std::error_code ignored;
  std::filesystem::remove(undo_name(path), ignored);
}

void bring_back_directory(const std::string& path) {
  std::ifstream file(undo_name(path), std::ios::binary);
  if (!file) return;
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  std::size_t at = magic.size();
  const auto next = [&] {
    std::uint64_t value = 0;
    if (at + sizeof(value) > text.size()) throw FileError(undo_name(path), "is damaged");
    std::memcpy(&value, text.data() + at, sizeof(value));
    at += sizeof(value);
    return value;
  };
  if (!text.starts_with(magic)) throw FileError(undo_name(path), "is damaged");
  const std::uint64_t length = next();
  Descriptor results(path, O_WRONLY);
  while (at < text.size()) {
    const std::uint64_t begin = next(), size = next();
    if (at + size > text.size()) throw FileError(undo_name(path), "is damaged");
    results.write_at(static_cast<std::int64_t>(begin), std::string_view(text).substr(at, size));
    at += size;
  }
  results.cut(static_cast<std::int64_t>(length));
  results.sync();
  results.close();
  drop_directory(path);
}

}  // namespace talus::io::detail
