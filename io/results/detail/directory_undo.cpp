#include "io/results/detail/directory_undo.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
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
    const auto [tree, heap] = group_at(number<std::uint64_t>(block, 64));
    const std::string names = heap_data(heap, false);
    std::uint64_t frames = 0;
    walk(tree, [&](const std::string& leaf, std::size_t entry) {
      const std::uint64_t name = number<std::uint64_t>(leaf, entry);
      if (name < names.size() && std::string_view(names.c_str() + name) == "frames")
        frames = number<std::uint64_t>(leaf, entry + 8);
    });
    const auto [frames_tree, frames_heap] = group_at(frames);
    heap_data(frames_heap, true);
    walk(frames_tree, [](const std::string&, std::size_t) {});
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
  /// Tree and heap of the group whose object header is there: its message 17. Messages go on in further
  /// blocks (message 16) where there are attributes.
  std::array<std::uint64_t, 2> group_at(std::uint64_t at) {
    constexpr std::uint64_t prefix = 16, message_prefix = 8, most = 1 << 16;
    constexpr std::uint16_t continuation = 16, symbol_table = 17;
    const std::string head = bytes(at, prefix);
    std::vector<Range> blocks{{at + prefix, number<std::uint32_t>(head, 8)}};
    if (head[0] != 1) sound_ = false;
    for (std::size_t b = 0; sound_ && b < blocks.size() && blocks.size() < most; ++b) {
      const std::uint64_t size = std::min(blocks[b].size, most);
      const std::string messages = bytes(blocks[b].begin, size);
      std::uint64_t k = 0;
      for (; k + message_prefix + 16 <= size; k += message_prefix + number<std::uint16_t>(messages, k + 2)) {
        const std::uint16_t type = number<std::uint16_t>(messages, k);
        const auto first = number<std::uint64_t>(messages, k + message_prefix),
                   second = number<std::uint64_t>(messages, k + message_prefix + 8);
        if (type == symbol_table) return {first, second};
        if (type == continuation) blocks.push_back({first, second});
      }
    }
    sound_ = false;
    return {0, 0};
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
    // A leaf may be the last of the file: no more is read than there is.
    const std::string signature = bytes(at, 4);
    const bool leaf = signature == "SNOD";
    if (!leaf && signature != "TREE") {
      sound_ = false;
      return;
    }
    const std::uint64_t size = leaf ? 8 + 40 * leaf_ : 24 + 8 * (2 * internal_ + 1);
    const std::string node = bytes(at, size);
    ranges_.push_back({at, size});
    for (std::size_t k = 0; k < number<std::uint16_t>(node, 6); ++k) {
      if (leaf)
        visit(node, 8 + 40 * k);
      else
        walk(number<std::uint64_t>(node, 32 + 16 * k), visit);
    }
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

bool directory_is_kept(const std::string& path) {
  std::error_code unknown;
  return std::filesystem::exists(undo_name(path), unknown);
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
