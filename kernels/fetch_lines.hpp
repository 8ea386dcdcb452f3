#pragma once

#include <cstddef>
#include <span>

namespace talus {

/// Asks for all cache lines of `values`, without waiting for them.
template <class Value>
void fetch_lines(std::span<const Value> values) {
  constexpr std::size_t line = 64;
  const auto bytes = std::as_bytes(values);
  for (std::size_t k = 0; k < bytes.size(); k += line) __builtin_prefetch(&bytes[k]);
  if (!bytes.empty()) __builtin_prefetch(&bytes.back());  // where the first does not begin a line
}

}  // namespace talus
