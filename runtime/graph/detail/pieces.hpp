#pragma once

#include <algorithm>
#include <cstddef>
#include <span>

namespace talus::graph::detail {

/// Calls work(begin, size) for pieces of at most `piece` > 0 of `bytes` bytes, in order.
template <class Work>
void in_pieces(std::size_t bytes, std::size_t piece, const Work& work) {
  for (std::size_t begin = 0; begin < bytes; begin += piece) work(begin, std::min(piece, bytes - begin));
}

/// Calls take(bytes of the piece) for pieces of at most `piece` > 0 bytes, in order.
template <class Take>
void each_piece(std::span<const std::byte> part, std::size_t piece, const Take& take) {
  in_pieces(part.size(), piece,
            [&](std::size_t begin, std::size_t size) { take(part.subspan(begin, size)); });
}

}  // namespace talus::graph::detail
