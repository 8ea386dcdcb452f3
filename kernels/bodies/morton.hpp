#pragma once

#include <cstdint>

namespace talus {

/// Spreads the low 21 bits of `value`: two zero bits between neighbours.
constexpr std::uint64_t spread_bits(std::uint32_t value) {
  std::uint64_t x = value & 0x1fffff;
  x = (x | x << 32) & 0x1f00000000ffffULL;
  x = (x | x << 16) & 0x1f0000ff0000ffULL;
  x = (x | x << 8) & 0x100f00f00f00f00fULL;
  x = (x | x << 4) & 0x10c30c30c30c30c3ULL;
  x = (x | x << 2) & 0x1249249249249249ULL;
  return x;
}

/// Morton (Z-order) key of integer coordinates below 2^21: near in space is near in key.
constexpr std::uint64_t morton_key(std::uint32_t x, std::uint32_t y, std::uint32_t z) {
  return spread_bits(x) | spread_bits(y) << 1 | spread_bits(z) << 2;
}

}  // namespace talus
