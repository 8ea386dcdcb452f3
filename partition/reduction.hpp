#pragma once

#include <cstdint>
#include <functional>
#include <span>

namespace talus {

/// Sums and maxima over the ranks that share a sample. This folder knows no MPI: a caller on several ranks
/// passes in-place all-reductions, and every rank calls them with the same lengths in the same order. Sums
/// are of integers and maxima are exact, so the result is the same for any number of ranks and any order of
/// summation. A default-constructed Reduction is that of one rank and does nothing.
struct Reduction {
  std::function<void(std::span<std::int64_t>)> sum = [](std::span<std::int64_t>) {};
  std::function<void(std::span<double>)> max = [](std::span<double>) {};
  bool first = true;  ///< true on exactly one rank
};

}  // namespace talus
