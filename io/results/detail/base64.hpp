#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "io/files/write_text.hpp"

namespace talus::io::detail {

static_assert(std::endian::native == std::endian::little, "the files say that they are little endian");

/// Bytes that come in pieces as base64 text.
class Base64 {
 public:
  explicit Base64(const WriteText& out) : out_(out) {}
  void add(std::span<const std::byte> bytes) {
    // The text of a large array would take more memory than the array.
    constexpr std::size_t piece = std::size_t{3} << 16;
    for (; bytes.size() > piece; bytes = bytes.subspan(piece)) add_piece(bytes.first(piece));
    add_piece(bytes);
  }
  void finish() {
    if (count_ > 0) {
      const int count = count_;
      group_ <<= 8 * (3 - count);
      put();
      for (int k = count; k < 3; ++k) text_[text_.size() - static_cast<std::size_t>(3 - k)] = '=';
    }
    flush();
  }

 private:
  void add_piece(std::span<const std::byte> bytes) {
    text_.reserve((bytes.size() + 2) / 3 * 4);
    for (const std::byte byte : bytes) {
      group_ = group_ << 8 | std::to_integer<std::uint32_t>(byte);
      if (++count_ == 3) put();
    }
    flush();
  }
  void put() {
    static constexpr char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const char four[] = {digits[group_ >> 18], digits[group_ >> 12 & 63], digits[group_ >> 6 & 63],
                         digits[group_ & 63]};
    text_.append(four, sizeof four);  // at once: digit by digit was a percent of a small run
    group_ = 0;
    count_ = 0;
  }
  void flush() {
    out_(text_);
    text_.clear();
  }

  const WriteText& out_;
  std::string text_;
  std::uint32_t group_ = 0;
  int count_ = 0;
};

/// All of it at once.
inline std::string base64_of(std::span<const std::byte> bytes) {
  std::string text;
  const WriteText out = [&](std::string_view more) { text += more; };
  Base64 base64(out);
  base64.add(bytes);
  base64.finish();
  return text;
}

}  // namespace talus::io::detail
