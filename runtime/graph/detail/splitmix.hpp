#pragma once

#include <cstdint>

namespace talus::graph::detail {

/// Finaliser of splitmix64 (Steele, Lea, Flood 2014): a bijection that scatters its input.
inline std::uint64_t scatter(std::uint64_t z) noexcept {
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31);
}

}  // namespace talus::graph::detail
