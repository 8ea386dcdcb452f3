#pragma once

#include <algorithm>
#include <cstddef>

namespace talus::graph::detail {

/// Calls work(begin, size) for pieces of at most `piece` > 0 of `bytes` bytes, in order.
template <class Work>
void in_pieces(std::size_t bytes, std::size_t piece, const Work& work) {
  for (std::size_t begin = 0; begin < bytes; begin += piece) work(begin, std::min(piece, bytes - begin));
}

}  // namespace talus::graph::detail
